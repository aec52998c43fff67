#include "render/stage/tracer.h"

#include "render/stage/random.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

namespace surflect {

namespace {

using Vector = Vec3<double>;
using Point = Point3<AcquisitionSpace, double>;
using Direction = Direction3<AcquisitionSpace, double>;

Vector vectorOf(const Rgb& color) { return {color.r, color.g, color.b}; }

// Any two unit vectors at right angles to a unit n and to each other.
std::pair<Vector, Vector> across(const Vector& n) {
  const Vector u = n.unitOrthogonal();
  return {u, n.cross(u)};
}

// Orthonormal, right-handed: x along the fibre, z out of the object.
struct ShadingFrame {
  Vector x, y, z;

  ShadingDirection toLocal(const Direction& w) const {
    return {x.dot(w.raw()), y.dot(w.raw()), z.dot(w.raw())};
  }
  Direction toWorld(const ShadingDirection& w) const {
    return normalized(assume<Direction>(w.x() * x + w.y() * y + w.z() * z));
  }
};

// A surface's sides are those of its triangles. Where an interpolated normal says otherwise than they which
// side is seen, it is bent until the viewer is above it. `facet` is turned together with the frame.
ShadingFrame frameAt(SurfaceHit& hit, const Direction& towardsViewer) {
  constexpr double kLeastCosine = 1e-3;
  Vector n = hit.normal.raw();
  n = n.squaredNorm() > 0 ? n.stableNormalized() : hit.facet.raw();
  if (n.dot(hit.facet.raw()) < 0) n = -n;
  const bool isSeenInside = dot(hit.facet, towardsViewer) < 0;
  if (isSeenInside && !std::holds_alternative<Dielectric>(hit.material)) {
    hit.facet = -hit.facet;
    n = -n;
  }
  const Vector w = (dot(hit.facet, towardsViewer) < 0 ? -1. : 1.) * towardsViewer.raw();
  if (const double cosine = n.dot(w); cosine < kLeastCosine)
    n = (n + (kLeastCosine - cosine) * w).normalized();
  const Vector t = hit.tangent.raw() - hit.tangent.raw().dot(n) * n;
  const Vector x = t.norm() > 1e-9 * hit.tangent.raw().norm() ? t.stableNormalized() : across(n).first;
  return {x, n.cross(x), n};
}

// 1 - cos(radius)
double capHeight(Angle radius) { return 2 * squared(std::sin(radius.radians() / 2)); }

// Radiance of a disc that gives irradiance 1 to a surface facing it: 1 / (pi sin^2 radius).
double discRadiance(Angle radius) { return 1 / (kPi * squared(std::sin(radius.radians()))); }

// A direction to a light, and what falls on a surface that faces it; of a disc's, radiance over density.
struct LightSample {
  Direction towards;
  Rgb irradiance;
  double distance;
};

LightSample towardsOneOf(const Light& light, const Point& p, Angle radius, double u, double v) {
  const Direction middle = towardsLight(light, p);
  const Rgb irradiance = irradianceAt(light, p);
  if (const auto* point = std::get_if<PointLight>(&light.kind))
    return {middle, irradiance, length(point->position - p)};
  if (!(radius.radians() > 0)) return {middle, irradiance, std::numeric_limits<double>::infinity()};
  const double height = capHeight(radius), z = 1 - u * height, r = std::sqrt(std::max(0.0, 1 - z * z));
  const auto [x, y] = across(middle.raw());
  const Vector w = r * std::cos(2 * kPi * v) * x + r * std::sin(2 * kPi * v) * y + z * middle.raw();
  return {normalized(assume<Direction>(w)), scaled(discRadiance(radius) * 2 * kPi * height, irradiance),
          std::numeric_limits<double>::infinity()};
}

// Paths from one camera, to all lights.
class PathTracer {
public:
  PathTracer(const StageScene& scene, std::span<const Light> lights, const TraceOptions& options)
      : scene_(scene), lights_(lights), options_(options) {}

  // Adds to each light's sum what comes along the ray to its origin; false where it meets nothing.
  bool add(Point origin, Direction direction, Random& random, std::vector<Vector>& sums) const {
    Vector throughput(1, 1, 1);
    Rgb absorption{0, 0, 0}; // where the path is
    bool isSpecular = false;
    for (int bounce = 0;; ++bounce) {
      auto hit = scene_.firstHit(origin, direction);
      if (!hit) {
        if (isSpecular) addLightsSeen(direction, throughput, sums);
        return bounce > 0;
      }
      throughput = throughput.cwiseProduct(vectorOf(transmittance(absorption, hit->distance)));
      const ShadingFrame frame = frameAt(*hit, -direction);
      const ShadingDirection wo = frame.toLocal(-direction);
      if (!surflect::isSpecular(hit->material)) addLights(*hit, frame, wo, throughput, random, sums);
      if (options_.transport == Transport::local) return true;

      const Uniforms uniforms{random.next(), random.next(), random.next()};
      const auto scattered = sample(hit->material, wo, uniforms);
      if (!scattered) return true;
      throughput = throughput.cwiseProduct(vectorOf(scattered->weight));
      direction = frame.toWorld(scattered->wi);
      if (!isOnItsSide(*hit, scattered->wi, direction) || !survives(bounce, throughput, random)) return true;
      if (const auto* glass = std::get_if<Dielectric>(&hit->material))
        absorption = isBelow(scattered->wi) ? glass->absorption : Rgb{0, 0, 0};
      isSpecular = scattered->specular;
      origin = scene_.leaving(*hit, direction);
    }
  }

private:
  // Interpolated normals and triangles agree on which side of the surface the light comes from.
  static bool isOnItsSide(const SurfaceHit& hit, const ShadingDirection& wi, const Direction& world) {
    return (wi.z() > 0) == (dot(hit.facet, world) > 0);
  }

  // Russian roulette, by what the path can still carry.
  static bool survives(int bounce, Vector& throughput, Random& random) {
    constexpr int kSafeBounces = 3;
    if (bounce < kSafeBounces) return throughput.maxCoeff() > 0;
    const double chance = std::min(0.95, throughput.maxCoeff());
    if (random.next() >= chance) return false;
    throughput /= chance;
    return true;
  }

  void addLights(const SurfaceHit& hit, const ShadingFrame& frame, const ShadingDirection& wo,
                 const Vector& throughput, Random& random, std::vector<Vector>& sums) const {
    const double u = random.next(), v = random.next();
    for (size_t i = 0; i < lights_.size(); ++i) {
      const LightSample light = towardsOneOf(lights_[i], hit.position, options_.lightRadius, u, v);
      const ShadingDirection wi = frame.toLocal(light.towards);
      const Rgb reflected = evaluate(hit.material, wi, wo) * light.irradiance;
      if (!(brightest(reflected) > 0)) continue;
      if (options_.transport == Transport::full &&
          (!isOnItsSide(hit, wi, light.towards) ||
           scene_.occluded(scene_.leaving(hit, light.towards), light.towards, light.distance)))
        continue;
      sums[i] += throughput.cwiseProduct(vectorOf(reflected));
    }
  }

  void addLightsSeen(const Direction& direction, const Vector& throughput, std::vector<Vector>& sums) const {
    if (!(options_.lightRadius.radians() > 0)) return;
    const double height = capHeight(options_.lightRadius), radiance = discRadiance(options_.lightRadius);
    for (size_t i = 0; i < lights_.size(); ++i)
      if (const auto* light = std::get_if<DirectionalLight>(&lights_[i].kind))
        if ((light->towards + -direction).raw().squaredNorm() / 2 < height)
          sums[i] += radiance * throughput.cwiseProduct(vectorOf(light->irradiance));
  }

  const StageScene& scene_;
  std::span<const Light> lights_;
  const TraceOptions& options_;
};

// Columns and rows of strata in a pixel, as square as the number of samples lets them be.
std::pair<int, int> strata(int samples) {
  int rows = static_cast<int>(std::sqrt(samples));
  while (samples % rows != 0) --rows;
  return {samples / rows, rows};
}

} // namespace

TracedView traceView(const StageScene& scene, const Camera<AcquisitionSpace>& camera, uint64_t view,
                     std::span<const Light> lights, const TraceOptions& options, const Progress& progress) {
  assert(options.samples > 0);
  constexpr int kTile = 16;
  const int width = camera.lens.width, height = camera.lens.height;
  TracedView traced{std::vector<Image>(lights.size(), Image(width, height, 3)), Image(width, height, 1)};
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const PathTracer tracer(scene, lights, options);
  const auto [columns, rows] = strata(options.samples);

  const auto tracePixel = [&](int x, int y, std::vector<Vector>& sums) {
    std::fill(sums.begin(), sums.end(), Vector::Zero());
    int covered = 0;
    for (int s = 0; s < options.samples; ++s) {
      Random random{options.seed, view, static_cast<uint64_t>(y) << 32 | static_cast<uint64_t>(x),
                    static_cast<uint64_t>(s)};
      const double u = (s % columns + random.next()) / columns, v = (s / columns + random.next()) / rows;
      if (const auto ray = rayThrough(camera.lens, {x + u, y + v}))
        covered += tracer.add(worldFromCamera(ray->origin), worldFromCamera(ray->direction), random, sums);
    }
    traced.alpha.at(x, y)[0] = static_cast<float>(covered) / static_cast<float>(options.samples);
    for (size_t i = 0; i < lights.size() && covered > 0; ++i)
      for (int c = 0; c < 3; ++c)
        traced.radiance[i].at(x, y)[static_cast<size_t>(c)] = static_cast<float>(sums[i][c] / covered);
  };

  const int across = (width + kTile - 1) / kTile, down = (height + kTile - 1) / kTile;
  std::atomic<int> done = 0;
  std::mutex reporting;
  tbb::parallel_for(0, across * down, [&](int tile) {
    std::vector<Vector> sums(lights.size());
    const int left = tile % across * kTile, top = tile / across * kTile;
    for (int y = top; y < std::min(height, top + kTile); ++y) {
      progress.checkpoint();
      for (int x = left; x < std::min(width, left + kTile); ++x) tracePixel(x, y, sums);
    }
    const int finished = ++done;
    const std::lock_guard lock(reporting);
    progress("tracing", static_cast<double>(finished) / (across * down));
  });
  return traced;
}

} // namespace surflect
