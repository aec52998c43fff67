// Notation: pixel p with normal n(p) shows a surface point that light l, in unit direction d_l(p), may
// illuminate; cosine c = max(0, n . d).
#include "srf/capture/rig.h"
#include "srf/image/color.h"
#include "srf/validation/light_order.h"
#include "srf/validation/light_samples.h"
#include "srf/validation/small_view.h"
#include "srf/validation/validation.h"
#include "surfel/math/bounds.h"

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

constexpr size_t kMostLights = 512; // of which all pairs are compared
constexpr double kLitShare = 0.1;   // minimum share of lit pixels for a usable light
constexpr double kMuchBetter = 0.25, kBetter = 0.15, kConvincing = 0.5; // correlations
constexpr double kNoShading = 0.1, kAsGood = 0.1, kClearlyBetter = 0.05;
constexpr double kUnitBonus = 0.003;     // correlation
constexpr double kTellableScale = 0.005; // 1 - correlation of the shadings by two scales of positions
constexpr double kFewSamples = 100;

// Matrix that negates and exchanges axes.
struct AxisMap {
  std::array<int, 3> from; // axis of the file for x, y, z
  std::array<int, 3> sign;

  Vec3<double> operator()(const Vec3<double>& v) const {
    return {sign[0] * v[from[0]], sign[1] * v[from[1]], sign[2] * v[from[2]]};
  }
  // Only negates, or exchanges y and z as worlds with y or z up.
  bool isUsual() const { return from[0] == 0; }
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
  std::vector<Correlation> ofLight;     // over all views
  std::vector<Correlation> knownAlbedo; // over views with known albedo: unknown albedo may look like shading

  Fit(const std::vector<LightSamples>& views, const std::vector<capture::Light>& lights)
      : ofLight(lights.size()), knownAlbedo(lights.size()) {
    for (const LightSamples& view : views) {
      Table expected;
      for (const LitShot& shot : view.shots) expected.push_back(shaded(view, lights[shot.light]));
      const Table ofView = withoutAlbedo(view, expected);
      for (size_t s = 0; s < expected.size(); ++s) {
        const Correlation fit = litCorrelation(ofView[s], expected[s]);
        ofLight[view.shots[s].light].add(fit);
        if (expected.size() >= kLightsForAlbedo) knownAlbedo[view.shots[s].light].add(fit);
      }
    }
  }
};

// Values clamped like photographs, minus their mean, of length 1; none if they are constant, or most of them
// 0.
std::optional<Eigen::VectorXd> standardised(std::vector<double> values) {
  clampAbove95(values);
  const auto lit = std::ranges::count_if(values, [](double v) { return v > 0; });
  if (static_cast<double>(lit) < kLitShare * static_cast<double>(values.size())) return std::nullopt;
  Eigen::VectorXd v =
      Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  v.array() -= v.mean();
  const double norm = v.norm();
  if (!(norm > 0) || !std::isfinite(norm)) return std::nullopt;
  return v / norm;
}

// Photographs of a view divided by the sum of all over the sum expected at albedo 1. The order of the lights
// does not change this quotient where all of them light the view.
Table withoutSum(const LightSamples& view, const Table& expected) {
  Table shown;
  for (const LitShot& shot : view.shots) shown.emplace_back(shot.luminance.begin(), shot.luminance.end());
  for (size_t i = 0; i < view.points.size(); ++i) {
    double sumShown = 0, sumExpected = 0;
    for (size_t s = 0; s < shown.size(); ++s) {
      sumShown += shown[s][i];
      sumExpected += expected[s][i];
    }
    for (auto& shot : shown) shot[i] = sumShown > 0 ? shot[i] * sumExpected / sumShown : 0;
  }
  return shown;
}

// Compares photographs with the shading by each light, over views with known albedo: unknown albedo may look
// like shading.
LightEvidence evidenceOf(const std::vector<LightSamples>& views, const std::vector<capture::Light>& lights,
                         const Progress& progress) {
  LightEvidence evidence(lights.size());
  for (const LightSamples& view : views) {
    progress.checkpoint();
    if (view.shots.size() < kLightsForAlbedo) continue;
    Table all(lights.size()), expected;
    tbb::parallel_for(size_t{0}, lights.size(), [&](size_t k) { all[k] = shaded(view, lights[k]); });
    for (const LitShot& shot : view.shots) expected.push_back(all[shot.light]);
    const Table shown = withoutSum(view, expected);
    std::vector<std::optional<Eigen::VectorXd>> shadings;
    for (const auto& shading : all) shadings.push_back(standardised(shading));
    for (size_t s = 0; s < shown.size(); ++s) {
      progress.checkpoint();
      const size_t l = view.shots[s].light;
      const auto picture = standardised(shown[s]);
      if (!picture || !shadings[l]) continue;
      const double own = picture->dot(*shadings[l]);
      for (size_t k = 0; k < lights.size(); ++k)
        if (shadings[k])
          evidence.add(l, k, own, picture->dot(*shadings[k]), shadings[l]->dot(*shadings[k]),
                       static_cast<double>(view.points.size()));
    }
  }
  return evidence;
}

// Light at a multiple of its position from `zero`, of the same irradiance there.
capture::Light scaledPosition(capture::Light light, double factor, const Vec3<double>& zero) {
  auto& point = std::get<capture::PointLight>(light.kind);
  point.position = assume<Point3<World, double>>(Vec3<double>(zero + factor * (point.position.raw() - zero)));
  point.intensity = static_cast<float>(factor * factor) * point.intensity;
  return light;
}

// Units of length and their ratio.
struct UnitRatio {
  double ratio;
  const char *small, *large;
};
constexpr std::array<UnitRatio, 6> kUnitRatios{{{1000, "millimetres", "metres"},
                                                {100, "centimetres", "metres"},
                                                {10, "millimetres", "centimetres"},
                                                {25.4, "millimetres", "inches"},
                                                {39.37, "inches", "metres"},
                                                {3.281, "feet", "metres"}}};

// Factors from 1/1000 to 1000: `isUnit` if units may differ by it.
struct PositionFactor {
  double factor;
  bool isUnit;
  bool isTried = true;
  double own = 0, other = 0; // sums of correlations over photographs, as stated and with the factor
  double apart = 0, count = 0;

  // As LightEvidence::gain(); 0 if both shadings look alike.
  double gain() const { return apart > kTellableScale * count ? (other - own) / apart : 0; }
};
std::vector<PositionFactor> positionFactors() {
  std::vector<PositionFactor> factors;
  for (int step = -24; step <= 24; ++step)
    if (std::abs(step) > 2) factors.push_back({std::pow(10.0, step / 8.0), false});
  for (const UnitRatio& units : kUnitRatios) {
    factors.push_back({units.ratio, true});
    factors.push_back({1 / units.ratio, true});
  }
  return factors;
}

// Compares a view's shading by positions times a factor with that by the stated ones.
void compare(PositionFactor& factor, const LightSamples& view,
             const std::vector<std::optional<Eigen::VectorXd>>& shadings, // by the stated ones, of each shot
             const std::vector<std::optional<Eigen::VectorXd>>& shown,
             const std::vector<capture::Light>& others) {
  Table changed;
  for (const LitShot& shot : view.shots) changed.push_back(shaded(view, others[shot.light]));
  Table byChanged = withoutSum(view, changed);
  for (size_t s = 0; s < changed.size(); ++s) {
    if (!shadings[s] || !shown[s]) continue;
    const auto shadingByOther = standardised(std::move(changed[s])),
               shownByOther = standardised(std::move(byChanged[s]));
    if (!shadingByOther || !shownByOther) continue;
    factor.own += shown[s]->dot(*shadings[s]);
    factor.other += shownByOther->dot(*shadingByOther);
    factor.apart += 1 - shadings[s]->dot(*shadingByOther);
    ++factor.count;
  }
}

// Factor of all positions of lights by which shading fits the photographs better; units are preferred to
// others that fit as well. Positions within the mesh's box are not tried, nor do views with few lights count.
// `zero`: the origin of the file's coordinates.
std::optional<Finding> checkPositionUnits(const std::vector<LightSamples>& views,
                                          const std::vector<capture::Light>& lights, const Vec3<double>& zero,
                                          const Eigen::AlignedBox3d& box, const Progress& progress) {
  const auto isPoint = [](const capture::Light& light) {
    return std::holds_alternative<capture::PointLight>(light.kind);
  };
  if (!std::ranges::all_of(lights, isPoint)) return std::nullopt;
  std::vector<PositionFactor> factors = positionFactors();
  for (const LightSamples& view : views) {
    if (view.shots.size() < kLightsForAlbedo) continue;
    Table stated;
    for (const LitShot& shot : view.shots) stated.push_back(shaded(view, lights[shot.light]));
    std::vector<std::optional<Eigen::VectorXd>> shadings, shown;
    for (auto& values : withoutSum(view, stated)) shown.push_back(standardised(std::move(values)));
    for (auto& values : stated) shadings.push_back(standardised(std::move(values)));
    tbb::parallel_for(size_t{0}, factors.size(), [&](size_t i) {
      progress.checkpoint();
      PositionFactor& factor = factors[i];
      if (!factor.isTried) return;
      std::vector<capture::Light> others;
      for (const capture::Light& light : lights) {
        const auto& other = others.emplace_back(scaledPosition(light, factor.factor, zero));
        factor.isTried &= !box.contains(std::get<capture::PointLight>(other.kind).position.raw());
      }
      if (factor.isTried) compare(factor, view, shadings, shown, others);
    });
  }
  std::erase_if(factors, [](const PositionFactor& factor) { return !(factor.gain() > kLikelierLight); });
  if (factors.empty()) return std::nullopt;
  const auto preference = [](const PositionFactor& factor) {
    return factor.other / factor.count + (factor.isUnit ? kUnitBonus : 0);
  };
  const PositionFactor best = *std::ranges::max_element(factors, {}, preference);
  const bool areNear = best.factor > 1;
  const double own = best.own / best.count, other = best.other / best.count;
  std::string units;
  for (const UnitRatio& one : kUnitRatios)
    if (best.isUnit && (best.factor == one.ratio || best.factor == 1 / one.ratio))
      units = fmt::format(" (are they in {}, and the poses in {}?)", areNear ? one.large : one.small,
                          areNear ? one.small : one.large);
  return Finding{
      other > own + kClearlyBetter ? Severity::error : Severity::warning,
      fmt::format("positions of lights look about {:.4g} times too {} the origin{} (correlation of "
                  "shading with the mesh's normals {:.3f}, as they are {:.3f}); multiply them by {:.4g}, and "
                  "intensities by its square",
                  std::max(best.factor, 1 / best.factor), areNear ? "near" : "far from", units, other, own,
                  best.factor)};
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

  // Photographs of one light against the shading by another.
  const size_t count = capture.lights.size();
  const bool areCompared = count <= kMostLights && std::ranges::any_of(views, [](const LightSamples& view) {
                             return view.shots.size() >= kLightsForAlbedo;
                           });
  LightEvidence evidence(areCompared ? count : 0);
  if (areCompared) evidence = evidenceOf(views, capture.lights, progress);
  const auto order =
      areCompared ? likeliestMistake(evidence, capture.lights, kFewSamples) : std::optional<OrderMistake>();
  if (order) {
    const auto [own, other] = evidence.correlations(*order);
    if (other > fits[best].value_or(-1) + (maps[best].isUsual() ? kClearlyBetter : -kClearlyBetter)) {
      findings.push_back(
          {Severity::error,
           fmt::format("the table of lights looks {}: {} (correlation of shading with the mesh's "
                       "normals {:.2f}, as it is {:.2f}); {}",
                       order->what, describe(*order, capture.lights), other, own, order->cure)});
      return findings;
    }
  }
  if (auto units =
          checkPositionUnits(views, capture.lights, -capture.origin, boundsOf(mesh.positions), progress)) {
    findings.push_back(*std::move(units));
    return findings;
  }
  if (!maps[best].isIdentity() && fits[best].value_or(-1) > std::max(kConvincing, *stated + kMuchBetter)) {
    findings.push_back(
        {Severity::error, fmt::format("light directions look {} (correlation of shading with the mesh's "
                                      "normals {:.2f}, as they are {:.2f})",
                                      describe(maps[best]), *fits[best], *stated)});
    return findings;
  }
  const std::vector<std::pair<size_t, size_t>> pairs =
      exchangedPairs(evidence, areCompared ? count : 0, kFewSamples);
  std::vector<Offender> exchanged, others, unlike;
  std::vector<bool> isInPair(count);
  for (const auto& [a, b] : pairs) {
    isInPair[a] = isInPair[b] = true;
    const auto [ownA, otherA] = evidence.correlations(a, b);
    const auto [ownB, otherB] = evidence.correlations(b, a);
    exchanged.push_back(
        {otherA - ownA + otherB - ownB,
         fmt::format("{} and {} (correlation {:.2f} and {:.2f}, as they are {:.2f} and {:.2f})",
                     capture.lights[a].name, capture.lights[b].name, otherA, otherB, ownA, ownB)});
  }
  for (size_t l = 0; l < count; ++l) {
    if (isInPair[l]) continue;
    size_t likeliest = l;
    double fit = kConvincing;
    for (size_t k = 0; k < count && areCompared; ++k) {
      const auto other = evidence.correlation(l, k, kFewSamples);
      if (other && *other > std::max(fit, evidence.correlations(l, k).first + kBetter) &&
          evidence.gain(l, k, kFewSamples).value_or(-1) > kLikelierLight)
        likeliest = k, fit = *other;
    }
    const auto own = asStated.knownAlbedo[l].value();
    if (likeliest != l)
      others.push_back(
          {fit - evidence.correlations(l, likeliest).first,
           fmt::format("{} by {} (correlation {:.2f}, by its own {:.2f})", capture.lights[l].name,
                       capture.lights[likeliest].name, fit, evidence.correlations(l, likeliest).first)});
    else if (own && *own < kNoShading)
      unlike.push_back({-*own, fmt::format("{} ({:.2f})", capture.lights[l].name, *own)});
  }
  const bool isExplainedByOthers = 2 * (2 * exchanged.size() + others.size()) > count;
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
  if (!isExplainedByOthers && *stated < kNoShading) {
    findings.push_back( // a warning, because fur and glazed surfaces do so in correct captures
        {Severity::warning, fmt::format("shading does not follow the directions of the lights (correlation "
                                        "with the mesh's normals {:.2f})",
                                        *stated)});
    return findings;
  }
  if (!exchanged.empty())
    findings.push_back(
        {Severity::warning,
         fmt::format("{} of {} lights look exchanged: {}; exchange their lines in the table of "
                     "lights, or their photographs",
                     2 * exchanged.size(), count, worst(exchanged))});
  if (!others.empty())
    findings.push_back(
        {Severity::warning, fmt::format("photographs of {} of {} lights look lit by another: {}",
                                        others.size(), count, worst(others))});
  if (!unlike.empty())
    findings.push_back(
        {Severity::warning,
         fmt::format("photographs of {} of {} lights do not follow the direction of their light "
                     "(correlation with the mesh's normals): {}",
                     unlike.size(), count, worst(unlike))});
  return findings;
}

} // namespace surflect::validation
