// Notation: pixel p with normal n(p) shows a surface point that light l, in unit direction d_l(p), may
// illuminate; cosine c = max(0, n . d).
#include "srf/capture/rig.h"
#include "srf/image/color.h"
#include "srf/validation/light_samples.h"
#include "srf/validation/small_view.h"
#include "srf/validation/validation.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace surflect::validation {

namespace {

using Severity = Finding::Severity;
using World = AcquisitionSpace;

constexpr size_t kLightsForAlbedo = 8;                  // minimum number to determine a pixel's albedo
constexpr double kLitShare = 0.1;                       // minimum share of lit pixels for a usable light
constexpr double kMuchBetter = 0.25, kConvincing = 0.5; // correlations
constexpr double kNoShading = 0.1, kAsGood = 0.1;
constexpr double kFewSamples = 100;

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
std::vector<double> shaded(const LightSamples& view, const capture::Light& light) {
  std::vector<double> values;
  for (size_t i = 0; i < view.points.size(); ++i)
    values.push_back(incident(light, view.points[i], view.normals[i]));
  return values;
}

// Photographs of a view divided by each pixel's albedo: the sum of its other photographs (a photograph must
// not confirm its own light) over the sum expected at albedo 1. Undivided with too few lights.
Table withoutAlbedo(const LightSamples& view, const Table& expected) {
  Table shown;
  for (const LitShot& shot : view.shots) shown.emplace_back(shot.luminance.begin(), shot.luminance.end());
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

  Fit(const std::vector<LightSamples>& views, const std::vector<capture::Light>& lights)
      : ofLight(lights.size()) {
    for (const LightSamples& view : views) {
      Table expected;
      for (const LitShot& shot : view.shots) expected.push_back(shaded(view, lights[shot.light]));
      const Table& ofView = shown.emplace_back(withoutAlbedo(view, expected));
      for (size_t s = 0; s < expected.size(); ++s)
        ofLight[view.shots[s].light].add(litCorrelation(ofView[s], expected[s]));
    }
  }
};

// Correlation of the photographs of light l with another light in its place, over views with known albedo;
// unknown albedo may look like shading.
Correlation fitOf(const std::vector<LightSamples>& views, const Fit& stated, size_t l,
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
  const std::vector<LightSamples> views = readLightSamples(capture, mesh, caster, effort, progress);
  std::vector<Finding> findings;

  size_t turned = 0, pixels = 0;
  for (const LightSamples& view : views) {
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
  const auto isBetter = [&](size_t a, size_t b) { return fits[a].value_or(-1) < fits[b].value_or(-1); };
  const auto bestOf = [&](size_t count) { // the first maps only negate
    size_t best = 0;
    for (size_t m = 0; m < count; ++m)
      if (isBetter(best, m)) best = m;
    return best;
  };
  const size_t negated = bestOf(8), any = bestOf(maps.size());
  const bool isExplained = fits[negated].value_or(-1) > fits[any].value_or(-1) - kAsGood;
  const size_t best = isExplained ? negated : any;
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
