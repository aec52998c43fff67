// Notation: pixel p with normal n(p) shows a surface point that light l, in unit direction d_l(p), may
// illuminate; cosine c = max(0, n . d).
#include "srf/capture/photograph.h"
#include "srf/image/color.h"
#include "srf/validation/names.h"
#include "srf/validation/outline_contrast.h"
#include "srf/validation/validation.h"
#include "surfel/base/evenly_spaced.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

namespace surflect::validation {

namespace {

using Severity = Finding::Severity;
using World = AcquisitionSpace;

constexpr size_t kPixels = 1500;           // per view
constexpr size_t kBytes = size_t{1} << 30; // of photographs in memory
constexpr size_t kLightsForAlbedo = 8;     // minimum number to determine a pixel's albedo
constexpr double kRimCosine = 0.25;        // n . towards camera; below, texels are mixed with others
constexpr double kLitShare = 0.1;          // minimum share of lit pixels for a usable light
constexpr double kMuchBetter = 0.25, kConvincing = 0.5; // correlations
constexpr double kNoShading = 0.1;
constexpr double kFewSamples = 100;

// One photograph at the selected pixels of its view.
struct Shot {
  size_t light;
  std::vector<float> luminance; // per pixel of the view
};

struct Samples {
  std::vector<Point3<World, double>> points;
  std::vector<Vec3<double>> normals; // towards the camera's side
  std::vector<size_t> pixels;        // index in the picture
  std::vector<Shot> shots;
  size_t seen = 0, turned = 0; // pixels of the mesh, inside masks or not; those showing backs
};

// Up to kPixels pixels that show the mesh, evenly chosen.
Samples samplePixels(const capture::Camera<World>& camera, const TriangleMesh& mesh,
                     const RayCaster<World>& caster) {
  Samples all;
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const double area = 1.0 * camera.lens.width * camera.lens.height;
  const int step = std::max(1, static_cast<int>(std::sqrt(area / (4.0 * kPixels))));
  for (int y = step / 2; y < camera.lens.height; y += step)
    for (int x = step / 2; x < camera.lens.width; x += step) {
      const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
      if (!ray) continue;
      const auto origin = worldFromCamera(ray->origin);
      const auto direction = worldFromCamera(ray->direction);
      const auto hit = caster.firstHit(origin, direction);
      if (!hit) continue;
      Vec3<double> n = areaVector(mesh, hit->triangle).normalized();
      const double cosine = -n.dot(direction.raw());
      if (!(std::abs(cosine) > kRimCosine)) continue;
      if (cosine < 0) n = -n;
      ++all.seen;
      all.turned += cosine < 0;
      all.points.push_back(origin + hit->distance * direction);
      all.normals.push_back(n);
      all.pixels.push_back(static_cast<size_t>(y) * static_cast<size_t>(camera.lens.width) +
                           static_cast<size_t>(x));
    }
  return all;
}

// Selected views with frames: some views with their lights, and one more frame for every other light.
std::map<size_t, std::vector<size_t>> chooseFrames(const capture::Capture& capture,
                                                   const CheckEffort& effort) {
  std::map<size_t, std::vector<size_t>> ofChosen, frames;
  for (const size_t view : evenlySpaced(capture.views.size(), effort.litViews)) ofChosen[view];
  for (size_t i = 0; i < capture.frames.size(); ++i)
    if (const auto chosen = ofChosen.find(capture.frames[i].view); chosen != ofChosen.end())
      chosen->second.push_back(i);
  std::vector<bool> hasLight(capture.lights.size(), false);
  const auto take = [&](size_t i) {
    frames[capture.frames[i].view].push_back(i);
    hasLight[*capture.frames[i].light] = true;
  };
  for (const auto& [view, ofView] : ofChosen)
    for (const size_t i : evenlySpaced(ofView.size(), effort.lightsOfView)) take(ofView[i]);
  if (!effort.everyLight) return frames;
  for (size_t i = 0; i < capture.frames.size(); ++i)
    if (!ofChosen.contains(capture.frames[i].view) && !hasLight[*capture.frames[i].light]) take(i);
  return frames;
}

std::vector<Samples> readSamples(const capture::Capture& capture, const TriangleMesh& mesh,
                                 const RayCaster<World>& caster, const CheckEffort& effort,
                                 const Progress& progress) {
  const auto frames = chooseFrames(capture, effort);
  std::vector<Samples> views;
  for (const auto& [view, ofView] : frames) {
    const capture::Camera<World>& camera = capture.views[view].camera;
    Samples& samples = views.emplace_back(samplePixels(camera, mesh, caster));
    const size_t bytes = size_t{48} * static_cast<size_t>(camera.lens.width) *
                         static_cast<size_t>(camera.lens.height),
                 batch = std::max<size_t>(1, kBytes / bytes);
    std::vector<bool> inObject(samples.pixels.size(), true);
    for (size_t first = 0; first < ofView.size(); first += batch) {
      progress("lights", (static_cast<double>(views.size() - 1) +
                          static_cast<double>(first) / static_cast<double>(ofView.size())) /
                             static_cast<double>(frames.size()));
      const auto some = std::span(ofView).subspan(first, std::min(batch, ofView.size() - first));
      const auto photographs = capture::readPhotographs(capture, some);
      for (size_t k = 0; k < some.size(); ++k) {
        Shot& shot = samples.shots.emplace_back(Shot{*capture.frames[some[k]].light, {}});
        for (size_t i = 0; i < samples.pixels.size(); ++i) {
          const float* radiance = &photographs[k].radiance.values[3 * samples.pixels[i]];
          shot.luminance.push_back(image::luma({radiance[0], radiance[1], radiance[2]}));
          if (!(photographs[k].alpha.values[samples.pixels[i]] > 0.5f)) inObject[i] = false;
        }
      }
    }
    size_t kept = 0; // pixels inside the masks
    for (size_t i = 0; i < inObject.size(); ++i) {
      if (!inObject[i]) continue;
      samples.points[kept] = samples.points[i];
      samples.normals[kept] = samples.normals[i];
      samples.pixels[kept] = samples.pixels[i];
      for (Shot& shot : samples.shots) shot.luminance[kept] = shot.luminance[i];
      ++kept;
    }
    samples.points.resize(kept);
    samples.normals.resize(kept);
    samples.pixels.resize(kept);
    for (Shot& shot : samples.shots) shot.luminance.resize(kept);
  }
  return views;
}

// Matrix that negates and exchanges axes.
struct AxisMap {
  std::array<int, 3> from; // axis of the file for x, y, z
  std::array<int, 3> sign;

  Vec3<double> operator()(const Vec3<double>& v) const {
    return {sign[0] * v[from[0]], sign[1] * v[from[1]], sign[2] * v[from[2]]};
  }
  bool isIdentity() const { return from == std::array{0, 1, 2} && sign == std::array{1, 1, 1}; }
};

std::vector<AxisMap> axisMaps() {
  std::vector<AxisMap> maps;
  std::array from{0, 1, 2};
  do
    for (int signs = 0; signs < 8; ++signs)
      maps.push_back({from, {signs & 1 ? -1 : 1, signs & 2 ? -1 : 1, signs & 4 ? -1 : 1}});
  while (std::ranges::next_permutation(from).found);
  return maps;
}

// "negated in y", or "(x, -z, y) for (x, y, z)".
std::string describe(const AxisMap& map) {
  const char* names = "xyz";
  std::string negated, mapped;
  for (size_t i = 0; i < 3; ++i) {
    const char name = names[map.from[i]];
    if (map.sign[i] < 0) negated += (negated.empty() ? "" : " and ") + std::string(1, names[i]);
    mapped += (i > 0 ? ", " : "") + std::string(map.sign[i] < 0 ? "-" : "") + name;
  }
  if (map.from == std::array{0, 1, 2}) return "negated in " + negated;
  return "exchanged: (" + mapped + ") fits better than (x, y, z)";
}

// Light with direction or position mapped.
capture::Light mapped(capture::Light light, const AxisMap& map) {
  if (auto* directional = std::get_if<capture::DirectionalLight>(&light.kind))
    directional->towards = assume<Direction3<World, double>>(map(directional->towards.raw()));
  else {
    auto& point = std::get<capture::PointLight>(light.kind);
    point.position = assume<Point3<World, double>>(map(point.position.raw()));
  }
  return light;
}

// Luma of the irradiance of a surface that faces the light.
double incident(const capture::Light& light, const Point3<World, double>& p, const Vec3<double>& n) {
  const double cosine = n.dot(capture::towardsLight(light, p).raw());
  return cosine > 0 ? cosine * static_cast<double>(image::luma(capture::irradianceAt(light, p))) : 0;
}

// Clamps highlights and noise at the 95th percentile.
void clampAbove95(std::vector<double>& values) {
  std::vector<double> sorted = values;
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 95 / 100);
  if (sorted.empty()) return;
  std::nth_element(sorted.begin(), at, sorted.end());
  for (double& value : values) value = std::min(value, *at);
}

// Pearson correlation with the weight of its samples; weight 0 if either side is constant.
struct Correlation {
  double sum = 0, weight = 0;

  std::optional<double> value() const {
    return weight >= kFewSamples ? std::optional(sum / weight) : std::nullopt;
  }
  void add(const Correlation& other) {
    sum += other.sum;
    weight += other.weight;
  }
};

Correlation correlate(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  double meanA = 0, meanB = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    meanA += a[i] / n;
    meanB += b[i] / n;
  }
  double aa = 0, ab = 0, bb = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - meanA) * (a[i] - meanA);
    ab += (a[i] - meanA) * (b[i] - meanB);
    bb += (b[i] - meanB) * (b[i] - meanB);
  }
  if (!(aa * bb > 0) || !std::isfinite(aa * bb)) return {};
  return {n * ab / std::sqrt(aa * bb), n};
}

// Values by shot and pixel.
using Table = std::vector<std::vector<double>>;

// Shading of a Lambert surface of albedo 1.
std::vector<double> shaded(const Samples& view, const capture::Light& light) {
  std::vector<double> values;
  for (size_t i = 0; i < view.points.size(); ++i)
    values.push_back(incident(light, view.points[i], view.normals[i]));
  return values;
}

// Photographs of a view divided by each pixel's albedo: the sum of its other photographs (a photograph must
// not confirm its own light) over the sum expected at albedo 1. Undivided with too few lights.
Table withoutAlbedo(const Samples& view, const Table& expected) {
  Table shown;
  for (const Shot& shot : view.shots) shown.emplace_back(shot.luminance.begin(), shot.luminance.end());
  for (size_t i = 0; i < view.points.size() && shown.size() >= kLightsForAlbedo; ++i) {
    double sumShown = 0, sumExpected = 0;
    for (size_t s = 0; s < shown.size(); ++s) {
      sumShown += shown[s][i];
      sumExpected += expected[s][i];
    }
    for (size_t s = 0; s < shown.size(); ++s) {
      const double others = sumShown - shown[s][i];
      shown[s][i] = others > 0 ? shown[s][i] * (sumExpected - expected[s][i]) / others : 0;
    }
  }
  for (auto& shot : shown) clampAbove95(shot);
  return shown;
}

// Correlation of a photograph with the shading by its light; none if the light leaves most of the view dark.
Correlation litCorrelation(const std::vector<double>& shown, const std::vector<double>& expected) {
  const auto lit = std::ranges::count_if(expected, [](double v) { return v > 0; });
  if (static_cast<double>(lit) < kLitShare * static_cast<double>(expected.size())) return {};
  return correlate(shown, expected);
}

// Agreement of lights with the photographs.
struct Fit {
  std::vector<Correlation> ofLight; // over all views
  std::vector<Table> shown;         // per view

  Fit(const std::vector<Samples>& views, const std::vector<capture::Light>& lights) : ofLight(lights.size()) {
    for (const Samples& view : views) {
      Table expected;
      for (const Shot& shot : view.shots) expected.push_back(shaded(view, lights[shot.light]));
      const Table& ofView = shown.emplace_back(withoutAlbedo(view, expected));
      for (size_t s = 0; s < expected.size(); ++s)
        ofLight[view.shots[s].light].add(litCorrelation(ofView[s], expected[s]));
    }
  }
};

// Correlation of the photographs of light l with another light in its place, over views with known albedo;
// unknown albedo may look like shading.
Correlation fitOf(const std::vector<Samples>& views, const Fit& stated, size_t l,
                  const capture::Light& other) {
  Correlation fit;
  for (size_t v = 0; v < views.size(); ++v)
    for (size_t s = 0; s < views[v].shots.size() && views[v].shots.size() >= kLightsForAlbedo; ++s)
      if (views[v].shots[s].light == l) fit.add(litCorrelation(stated.shown[v][s], shaded(views[v], other)));
  return fit;
}

std::optional<double> meanOf(const std::vector<Correlation>& ofLight) {
  Correlation all;
  for (const Correlation& one : ofLight) all.add(one);
  return all.value();
}

} // namespace

std::vector<Finding> checkLights(const capture::Capture& capture, const TriangleMesh& mesh,
                                 const RayCaster<AcquisitionSpace>& caster, const CheckEffort& effort,
                                 std::optional<double> outlineContrast, const Progress& progress) {
  if (capture.lights.empty()) return {};
  const std::vector<Samples> views = readSamples(capture, mesh, caster, effort, progress);
  std::vector<Finding> findings;

  size_t turned = 0, pixels = 0;
  for (const Samples& view : views) {
    turned += view.turned;
    pixels += view.seen;
  }
  if (2 * turned > pixels)
    findings.push_back(
        {Severity::error, fmt::format("the faces of the mesh point inwards: {:.0f} % of what cameras "
                                      "see are backs",
                                      100.0 * static_cast<double>(turned) / static_cast<double>(pixels))});

  const Fit asStated(views, capture.lights);
  const auto stated = meanOf(asStated.ofLight);
  if (!stated) return findings;

  const std::vector<AxisMap> maps = axisMaps();
  std::vector<std::optional<double>> fits(maps.size());
  tbb::parallel_for(size_t{0}, maps.size(), [&](size_t m) {
    progress.checkpoint();
    std::vector<capture::Light> lights;
    for (const capture::Light& light : capture.lights) lights.push_back(mapped(light, maps[m]));
    fits[m] = meanOf(Fit(views, lights).ofLight);
  });
  size_t best = 0;
  for (size_t m = 0; m < maps.size(); ++m)
    if (fits[m].value_or(-1) > fits[best].value_or(-1)) best = m;
  if (!maps[best].isIdentity() && fits[best].value_or(-1) > std::max(kConvincing, *stated + kMuchBetter)) {
    findings.push_back(
        {Severity::error, fmt::format("light directions look {} (correlation of shading with the mesh's "
                                      "normals {:.2f}, as they are {:.2f})",
                                      describe(maps[best]), *fits[best], *stated)});
    return findings;
  }
  if (*stated < kConvincing && outlineContrast && *outlineContrast < kFlatOutline) {
    const bool differ = *stated < kNoShading;
    findings.push_back(
        {differ ? Severity::error : Severity::warning,
         fmt::format("the mesh {} lie where the photographs show it: they are {:.1f} times as steep at its "
                     "outline as beside it (expected {} or more), and shading correlates by {:.2f} with its "
                     "normals (expected {})",
                     differ ? "does not" : "may not", *outlineContrast, kSteepOutline, *stated,
                     kConvincing)});
    if (differ) return findings;
  }
  if (*stated < kNoShading) {
    findings.push_back( // a warning, because fur and glazed surfaces do so in correct captures
        {Severity::warning, fmt::format("shading does not follow the directions of the lights (correlation "
                                        "with the mesh's normals {:.2f})",
                                        *stated)});
    return findings;
  }

  // Compare photographs of one light with the direction of another.
  const size_t count = capture.lights.size();
  struct Likeliest {
    std::optional<double> own;
    size_t light;
    double fit;
  };
  std::vector<Likeliest> likeliest(count);
  tbb::parallel_for(size_t{0}, count, [&](size_t l) {
    progress.checkpoint();
    const auto own = fitOf(views, asStated, l, capture.lights[l]).value();
    likeliest[l] = {own, l, own.value_or(1)};
    if (!own || *own > kConvincing) return;
    for (size_t other = 0; other < count; ++other)
      if (const auto fit = fitOf(views, asStated, l, capture.lights[other]).value();
          fit && *fit > likeliest[l].fit)
        likeliest[l] = {own, other, *fit};
  });
  std::vector<Offender> exchanged, unlike;
  for (size_t l = 0; l < count; ++l) {
    const auto& [own, other, fit] = likeliest[l];
    if (!own) continue;
    if (fit > std::max(kConvincing, *own + kMuchBetter))
      exchanged.push_back(
          {fit - *own, fmt::format("{} by {} (correlation {:.2f}, by its own {:.2f})", capture.lights[l].name,
                                   capture.lights[other].name, fit, *own)});
    else if (*own < kNoShading)
      unlike.push_back({-*own, fmt::format("{} ({:.2f})", capture.lights[l].name, *own)});
  }
  if (!exchanged.empty())
    findings.push_back(
        {Severity::warning, fmt::format("photographs of {} of {} lights look lit by another: {}",
                                        exchanged.size(), count, worst(exchanged))});
  if (!unlike.empty())
    findings.push_back(
        {Severity::warning,
         fmt::format("photographs of {} of {} lights do not follow the direction of their light "
                     "(correlation with the mesh's normals): {}",
                     unlike.size(), count, worst(unlike))});
  return findings;
}

} // namespace surflect::validation
