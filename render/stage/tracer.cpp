#include "render/stage/tracer.h"

#include "render/stage/random.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <mutex>
#include <numeric>
#include <utility>

namespace surflect::stage {

namespace {

using Vector = Vec3<double>;
using Point = Point3<AcquisitionSpace, double>;
using Direction = Direction3<AcquisitionSpace, double>;

Vector vectorOf(const Rgb& color) { return {color.r, color.g, color.b}; }
Rgb rgbOf(const Vector& color) {
  return {static_cast<float>(color[0]), static_cast<float>(color[1]), static_cast<float>(color[2])};
}

// Orthonormal, right-handed frame: x along the fibre, z out of the object.
struct ShadingFrame {
  Vector x, y, z;

  material::ShadingDirection toLocal(const Direction& w) const {
    return {x.dot(w.raw()), y.dot(w.raw()), z.dot(w.raw())};
  }
  Direction toWorld(const material::ShadingDirection& w) const {
    return normalized(assume<Direction>(w.x() * x + w.y() * y + w.z() * z));
  }
};

// Shading frame at a hit. The sides of a surface are those of its triangles. If an interpolated normal faces
// away from the viewer, it is bent until the viewer is above it. `facet` is flipped together with the frame.
ShadingFrame frameAt(SurfaceHit& hit, const Direction& towardsViewer) {
  constexpr double kLeastCosine = 1e-3;
  Vector n = hit.normal.raw();
  n = n.squaredNorm() > 0 ? n.stableNormalized() : hit.facet.raw();
  if (n.dot(hit.facet.raw()) < 0) n = -n;
  const bool isSeenInside = dot(hit.facet, towardsViewer) < 0;
  if (isSeenInside && !std::holds_alternative<material::Dielectric>(hit.material)) {
    hit.facet = -hit.facet;
    n = -n;
  }
  const Vector w = (dot(hit.facet, towardsViewer) < 0 ? -1. : 1.) * towardsViewer.raw();
  if (const double cosine = n.dot(w); cosine < kLeastCosine)
    n = (n + (kLeastCosine - cosine) * w).normalized();
  const Vector t = hit.tangent.raw() - hit.tangent.raw().dot(n) * n;
  const Vector x = t.norm() > 1e-9 * hit.tangent.raw().norm() ? t.stableNormalized() : n.unitOrthogonal();
  return {x, n.cross(x), n};
}

// Share of the first of two sampling strategies with densities p and q.  [Veach 1997, §9.2.4, power
// heuristic]
double powerShare(double p, double q) { return p * p / (p * p + q * q); }

struct Path {
  Random random;
  // Strata of a pixel's samples at the first surface: for sampling lights, and for continuing the path.
  std::array<uint32_t, 2> cells;
  Point origin;
  Direction direction;
  Vector* sums; // radiance along the path, one per light
  Vector throughput{1, 1, 1};
  Rgb absorption{0, 0, 0}; // of the medium that the path is in
  double density = 0;      // of the direction; 0 if no other strategy can find it
  bool isAlive = true, hasHit = false;
  bool isRefracted = true; // at every surface so far
  double transmitted = 0;  // of the light behind the object, mean of the channels
};

// Contributions to paths that still need a shadow test.
struct Candidates {
  struct Share {
    Rgb light;
    Vector* sum;
  };
  std::vector<ShadowRay> rays;
  std::vector<Share> shares;
};

// Traces a few paths from one camera at a time, for all lights.
class PathTracer {
public:
  PathTracer(const StageScene& scene, std::span<const capture::Light> lights, const TraceOptions& options)
      : scene_(scene), transport_(options.transport), seesLights_(options.lightRadius.radians() > 0),
        strata_(static_cast<uint32_t>(options.samples)), order_(lights.size()), ofLight_(lights.size()),
        towards_(lights.size()), values_(lights.size()), densities_(lights.size()) {
    for (const capture::Light& light : lights) lamps_.emplace_back(light, options.lightRadius);
    std::iota(order_.begin(), order_.end(), size_t{0});
    std::ranges::stable_sort(order_, {}, [&](size_t i) { return lamps_[i].octant(); });
  }

  // Adds the radiance along each path to its sums. First hits are close together, so shadow rays are grouped
  // by light there, and by point at later hits.
  void walk(std::span<Path> paths) {
    for (int bounce = 0; std::ranges::any_of(paths, &Path::isAlive); ++bounce) {
      for (Path& path : paths)
        if (path.isAlive) path.isAlive = step(path, bounce);
      if (bounce == 0)
        for (Candidates& candidates : ofLight_) settle(candidates, Beam::narrow);
    }
  }

private:
  // Extends a path to the next surface; returns false where it ends.
  bool step(Path& path, int bounce) {
    auto hit = scene_.firstHit(path.origin, path.direction);
    if (!hit) {
      if (bounce > 0) addLightsSeen(path);
      if (bounce > 0 && path.isRefracted) path.transmitted = path.throughput.mean();
      return false;
    }
    if (bounce > 0 && transport_ == Transport::direct) return false;
    path.hasHit = true;
    path.throughput =
        path.throughput.cwiseProduct(vectorOf(material::transmittance(path.absorption, hit->distance)));
    const ShadingFrame frame = frameAt(*hit, -path.direction);
    const material::Bsdf view = material::bsdfAt(frame.toLocal(-path.direction), hit->material);
    if (!material::isSpecular(hit->material)) askLights(path, *hit, frame, view, bounce);
    if (transport_ != Transport::full && !seesLights_) return false;

    const auto [v, w] = square(path, bounce, 1);
    const material::Uniforms uniforms{path.random.next(), v, w};
    const auto scattered = sample(view, uniforms);
    if (!scattered) return false;
    path.throughput = path.throughput.cwiseProduct(vectorOf(scattered->weight));
    path.isRefracted = path.isRefracted && std::holds_alternative<material::Dielectric>(hit->material) &&
                       material::isBelow(scattered->wi) != material::isBelow(frame.toLocal(-path.direction));
    path.direction = frame.toWorld(scattered->wi);
    path.density = scattered->pdf;
    if (transport_ == Transport::local) {
      addLightsSeen(path);
      return false;
    }
    if (!isOnItsSide(*hit, scattered->wi, path.direction) || !survives(path, bounce)) return false;
    if (const auto* glass = std::get_if<material::Dielectric>(&hit->material))
      path.absorption = material::isBelow(scattered->wi) ? glass->absorption : glass->absorptionOutside;
    path.origin = scene_.leaving(*hit, path.direction);
    return true;
  }

  // Returns whether interpolated normal and triangle agree on the side that the light comes from.
  static bool isOnItsSide(const SurfaceHit& hit, const material::ShadingDirection& wi,
                          const Direction& world) {
    return (wi.z() > 0) == (dot(hit.facet, world) > 0);
  }

  // Random numbers for a direction.
  std::pair<double, double> square(Path& path, int bounce, size_t set) const {
    if (bounce == 0) return strata_.in(path.cells[set], path.random);
    const double u = path.random.next(), v = path.random.next();
    return {u, v};
  }

  // Russian roulette, by the path's remaining throughput.
  static bool survives(Path& path, int bounce) {
    constexpr int kSafeBounces = 3;
    const double most = path.throughput.maxCoeff();
    if (bounce < kSafeBounces) return most > 0;
    const double chance = std::min(0.95, most);
    if (path.random.next() >= chance) return false;
    path.throughput /= chance;
    return true;
  }

  void askLights(Path& path, const SurfaceHit& hit, const ShadingFrame& frame, const material::Bsdf& view,
                 int bounce) {
    const auto [u, v] = square(path, bounce, 0);
    const bool isOpaque = !std::holds_alternative<material::DielectricBsdf>(view);
    const bool isHindered = transport_ != Transport::local;
    asked_.clear();
    for (const size_t light : order_) {
      const Lamp::Sample sample = lamps_[light].sample(hit.position, u, v);
      if (isOpaque && !(frame.z.dot(sample.towards.raw()) > 0)) continue;
      const material::ShadingDirection wi = frame.toLocal(sample.towards);
      if (isHindered && !isOnItsSide(hit, wi, sample.towards)) continue;
      towards_[asked_.size()] = wi;
      asked_.push_back({light, sample});
    }
    const std::span wi = std::span(towards_).first(asked_.size());
    material::evaluate(view, wi, std::span(values_).first(wi.size()));
    if (seesLights_) material::pdf(view, wi, std::span(densities_).first(wi.size()));
    for (size_t i = 0; i < asked_.size(); ++i) {
      const auto& [light, sample] = asked_[i];
      const double density = lamps_[light].density();
      const double share = density > 0 ? powerShare(density, densities_[i]) : 1;
      const Rgb reflected = material::scaled(share, values_[i] * sample.irradiance) * rgbOf(path.throughput);
      if (!(material::brightest(reflected) > 0)) continue;
      if (!isHindered) {
        path.sums[light] += vectorOf(reflected);
        continue;
      }
      Candidates& candidates = bounce == 0 ? ofLight_[light] : ofPath_;
      candidates.rays.push_back(
          scene_.shadowRay(scene_.leaving(hit, sample.towards), sample.towards, sample.distance));
      candidates.shares.push_back({reflected, &path.sums[light]});
    }
    settle(ofPath_, Beam::wide);
  }

  // Adds the contributions that are not blocked.
  void settle(Candidates& candidates, Beam beam) const {
    for (size_t first = 0; first < candidates.rays.size(); first += kMostRays) {
      const size_t count = std::min(kMostRays, candidates.rays.size() - first);
      const uint32_t occluded = scene_.occluded(std::span(candidates.rays).subspan(first, count), beam);
      for (size_t i = 0; i < count; ++i)
        if (!(occluded >> i & 1)) {
          const auto& [light, sum] = candidates.shares[first + i];
          *sum += vectorOf(light);
        }
    }
    candidates.rays.clear();
    candidates.shares.clear();
  }

  void addLightsSeen(const Path& path) const {
    if (!seesLights_) return;
    for (size_t i = 0; i < lamps_.size(); ++i)
      if (const auto radiance = lamps_[i].seen(path.origin, path.direction)) {
        const double share = path.density > 0 ? powerShare(path.density, lamps_[i].density()) : 1;
        path.sums[i] += share * path.throughput.cwiseProduct(vectorOf(*radiance));
      }
  }

  struct Asked {
    size_t light;
    Lamp::Sample sample;
  };

  const StageScene& scene_;
  Transport transport_;
  bool seesLights_; // whether paths can hit lights, which then have an extent
  Strata strata_;
  std::vector<Lamp> lamps_;
  std::vector<size_t> order_; // sorted so that neighbours are in one octant
  // Kept between calls to reuse memory.
  std::vector<Candidates> ofLight_;
  Candidates ofPath_;
  std::vector<Asked> asked_;
  std::vector<material::ShadingDirection> towards_;
  std::vector<Rgb> values_;
  std::vector<double> densities_;
};

// Column and row of the i-th of 64 pixels of a square, in an order in which successive pixels are neighbours.
std::pair<int, int> placeInTile(int i) {
  const auto everySecondBit = [](int bits) { return (bits & 1) | (bits >> 1 & 2) | (bits >> 2 & 4); };
  return {everySecondBit(i), everySecondBit(i >> 1)};
}

// Traces squares of pixels of one view; kept per thread to reuse memory.
class TileTracer {
public:
  static constexpr int kSide = 8; // see placeInTile

  TileTracer(const StageScene& scene, const capture::Camera<AcquisitionSpace>& camera, uint64_t view,
             std::span<const capture::Light> lights, const TraceOptions& options, const Progress& progress)
      : tracer_(scene, lights, options), camera_(camera), worldFromCamera_(camera.cameraFromWorld.inverse()),
        view_(view), lights_(lights.size()), options_(options), progress_(progress),
        strata_(static_cast<uint32_t>(options.samples)), sums_(kSide * kSide * lights.size()) {}

  // Traces the square that begins at this pixel, clipped to the picture.
  void trace(int left, int top, TracedView& traced) {
    std::ranges::fill(sums_, Vector::Zero());
    covered_.fill(0);
    transmitted_.fill(0);
    forEachPixel(left, top, [&](int place, int x, int y) { addPaths(place, x, y); });
    walk();
    forEachPixel(left, top, [&](int place, int x, int y) { take(place, traced, x, y); });
  }

private:
  void forEachPixel(int left, int top, const auto& function) const {
    for (int place = 0; place < kSide * kSide; ++place) {
      const auto [column, row] = placeInTile(place);
      const int x = left + column, y = top + row;
      if (x < camera_.lens.width && y < camera_.lens.height) function(place, x, y);
    }
  }

  void addPaths(int place, int x, int y) {
    const uint64_t pixel = static_cast<uint64_t>(y) << 32 | static_cast<uint64_t>(x);
    Random ofPixel{options_.seed, view_, pixel};
    const auto asking = strata_.shuffled(ofPixel), goingOn = strata_.shuffled(ofPixel);
    for (uint32_t s = 0; s < static_cast<uint32_t>(options_.samples); ++s) {
      Random random{options_.seed, view_, pixel, s};
      const auto [u, v] = strata_.in(s, random);
      const auto ray = capture::rayThrough(camera_.lens, {x + u, y + v});
      if (!ray) continue;
      paths_.push_back({random,
                        {asking[s], goingOn[s]},
                        worldFromCamera_(ray->origin),
                        worldFromCamera_(ray->direction),
                        &sums_[static_cast<size_t>(place) * lights_]});
      places_.push_back(static_cast<size_t>(place));
      if (paths_.size() == kMostRays) walk();
    }
  }

  void walk() {
    progress_.checkpoint();
    tracer_.walk(paths_);
    for (size_t i = 0; i < paths_.size(); ++i) {
      covered_[places_[i]] += paths_[i].hasHit;
      if (options_.matte == Matte::transmittance) transmitted_[places_[i]] += paths_[i].transmitted;
    }
    paths_.clear();
    places_.clear();
  }

  void take(int place, TracedView& traced, int x, int y) const {
    // Samples that do not show the background.
    const double covered =
        std::max(0., covered_[static_cast<size_t>(place)] - transmitted_[static_cast<size_t>(place)]);
    traced.alpha.at(x, y)[0] = static_cast<float>(covered) / static_cast<float>(options_.samples);
    if (covered == 0) return;
    for (size_t light = 0; light < lights_; ++light) {
      const Vector mean = sums_[static_cast<size_t>(place) * lights_ + light] / covered;
      for (int c = 0; c < 3; ++c)
        traced.radiance[light].at(x, y)[static_cast<size_t>(c)] = static_cast<float>(mean[c]);
    }
  }

  PathTracer tracer_;
  const capture::Camera<AcquisitionSpace>& camera_;
  Rigid<AcquisitionSpace, CameraSpace> worldFromCamera_;
  uint64_t view_;
  size_t lights_;
  const TraceOptions& options_;
  const Progress& progress_;
  Strata strata_;
  std::vector<Vector> sums_; // [pixels][lights]
  std::array<int, kSide * kSide> covered_{};
  std::array<double, kSide * kSide> transmitted_{};
  std::vector<Path> paths_;
  std::vector<size_t> places_; // pixel of each path
};

} // namespace

TracedView traceView(const StageScene& scene, const capture::Camera<AcquisitionSpace>& camera, uint64_t view,
                     std::span<const capture::Light> lights, const TraceOptions& options,
                     const Progress& progress) {
  assert(options.samples > 0);
  constexpr int kSide = TileTracer::kSide;
  const int width = camera.lens.width, height = camera.lens.height;
  TracedView traced{std::vector<image::Image>(lights.size(), image::Image(width, height, 3)),
                    image::Image(width, height, 1)};
  const int across = (width + kSide - 1) / kSide, down = (height + kSide - 1) / kSide;
  tbb::enumerable_thread_specific<TileTracer> tracers(
      [&] { return TileTracer(scene, camera, view, lights, options, progress); });
  std::atomic<int> done = 0;
  std::mutex reporting;
  tbb::parallel_for(0, across * down, [&](int tile) {
    tracers.local().trace(tile % across * kSide, tile / across * kSide, traced);
    const int finished = ++done;
    const std::lock_guard lock(reporting);
    progress("tracing", static_cast<double>(finished) / (across * down));
  });
  return traced;
}

} // namespace surflect::stage
