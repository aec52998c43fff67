#include "srf/capture/mask_file.h"
#include "srf/image/color.h"
#include "srf/image/image_file.h"
#include "srf/validation/small_view.h"
#include "srf/validation/validation.h"
#include "surfel/base/text.h"
#include "surfel/math/bounds.h"
#include "surfel/math/median.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

namespace surflect::validation {

namespace {

using Severity = Finding::Severity;
using Point = Point3<AcquisitionSpace, double>;

constexpr int kRim = 2; // pixels of a small view
constexpr double kMaskShare = 0.02;
constexpr double kClippedShare = 0.5, kBlackShare = 1e-3;
constexpr size_t kPointsOfView = 400, kFewPairs = 50;
constexpr double kLeastCosine = 0.4; // minimum cosine of the surface to both cameras
constexpr double kNearViews = 0.25;  // cosine between the directions to two cameras
constexpr size_t kNeighbours = 8;
constexpr double kAgreeing = 0.8, kDiffering = 0.5; // correlations

float lumaAt(const image::Image& image, size_t pixel) {
  const float* value = &image.values[3 * pixel];
  return image::luma({value[0], value[1], value[2]});
}

image::Mask complement(image::Mask mask) {
  for (uint8_t& inside : mask.inside) inside = !inside;
  return mask;
}

// Mean of values over pixels in `outer` but not in `inner`; 0 without such pixels.
double ringMean(const std::vector<float>& values, const image::Mask& outer, const image::Mask& inner) {
  double sum = 0, count = 0;
  for (size_t i = 0; i < values.size(); ++i)
    if (outer.inside[i] && !inner.inside[i]) {
      sum += static_cast<double>(values[i]);
      ++count;
    }
  return count > 0 ? sum / count : 0;
}

// Logarithm of luminance, clamped at dark noise, so that steps count alike in light and shadow.
std::vector<float> logLuma(const image::Image& image) {
  std::vector<float> values(image.values.size() / 3);
  for (size_t i = 0; i < values.size(); ++i) values[i] = std::max(0.f, lumaAt(image, i));
  const float floor = 0.02f * std::max(*std::ranges::max_element(values), 1e-6f);
  for (float& value : values) value = std::log(value + floor);
  return values;
}

std::vector<float> gradientMagnitude(const std::vector<float>& values, int width, int height) {
  std::vector<float> magnitude(values.size(), 0.f);
  const auto at = [&](int x, int y) { return values[static_cast<size_t>(y * width + x)]; };
  for (int y = 1; y + 1 < height; ++y)
    for (int x = 1; x + 1 < width; ++x)
      magnitude[static_cast<size_t>(y * width + x)] =
          std::hypot(at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1));
  return magnitude;
}

std::optional<double> outlineContrastOf(const SmallView& view) {
  const image::Mask &inside = view.outline, outside = complement(view.outline);
  const auto steep = gradientMagnitude(logLuma(view.radiance), inside.width, inside.height);
  const int reach = std::max(8, std::max(inside.width, inside.height) / 24);
  const image::Mask core = image::eroded(inside, 4), halo = complement(image::eroded(outside, 4));
  const double atOutline = std::max(ringMean(steep, inside, image::eroded(inside, kRim)),
                                    ringMean(steep, outside, image::eroded(outside, kRim)));
  const double within = ringMean(steep, core, image::eroded(inside, reach)),
               beyond = ringMean(steep, complement(halo), image::eroded(outside, reach));
  const double off = (within + beyond) / 2;
  if (!(off > 0)) return std::nullopt;
  return atOutline / off;
}

struct Sums {
  double n = 0, a = 0, b = 0, aa = 0, ab = 0, bb = 0;

  void add(double x, double y) { n += 1, a += x, b += y, aa += x * x, ab += x * y, bb += y * y; }
  // Pearson correlation; none if either side is constant.
  std::optional<double> correlation() const {
    const double va = aa / n - a / n * (a / n), vb = bb / n - b / n * (b / n);
    if (!(va * vb > 0)) return std::nullopt;
    return (ab / n - a / n * (b / n)) / std::sqrt(va * vb);
  }
};

// A point of the mesh that a view shows, with its value there.
struct SeenPoint {
  Point place;
  Vec3<double> normal; // unit, towards the camera
  float value;
};

std::vector<SeenPoint> seenPoints(const SmallView& view, const std::vector<float>& values,
                                  const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& caster) {
  std::vector<size_t> pixels;
  const image::Mask core = image::eroded(view.outline, kRim);
  for (size_t i = 0; i < core.inside.size(); ++i)
    if (core.inside[i]) pixels.push_back(i);
  std::vector<SeenPoint> points;
  const auto worldFromCamera = view.camera.cameraFromWorld.inverse();
  for (const size_t k : evenlySpaced(pixels.size(), kPointsOfView)) {
    const size_t pixel = pixels[k], width = static_cast<size_t>(core.width);
    const auto ray = capture::rayThrough(view.camera.lens, {static_cast<double>(pixel % width) + 0.5,
                                                            static_cast<double>(pixel / width) + 0.5});
    if (!ray) continue;
    const auto origin = worldFromCamera(ray->origin);
    const auto direction = worldFromCamera(ray->direction);
    const auto hit = caster.firstHit(origin, direction);
    if (!hit) continue;
    Vec3<double> normal = areaVector(mesh, hit->triangle).normalized();
    if (normal.dot(direction.raw()) > 0) normal = -normal;
    points.push_back({origin + hit->distance * direction, normal, values[pixel]});
  }
  return points;
}

// Sum of correlations, weighted by their numbers of pairs.
struct Agreement {
  double sum = 0, weight = 0;
};

// Correlation between the values of points in one view and in the others.
Agreement agreementOf(const SmallView& a, std::span<const SeenPoint> points, const SmallView& b,
                      const std::vector<float>& valuesOfB, const RayCaster<AcquisitionSpace>& caster) {
  const capture::Viewpoint fromA(a.camera), fromB(b.camera);
  Sums pairs;
  for (const auto& [place, normal, value] : points) {
    const auto towardsA = fromA.towards(place), towardsB = fromB.towards(place);
    const auto pixel = b.camera.project(place);
    if (!pixel || !capture::contains(b.camera.lens, *pixel) || dot(towardsA, towardsB) < kNearViews ||
        normal.dot(towardsA.raw()) < kLeastCosine || normal.dot(towardsB.raw()) < kLeastCosine ||
        caster.occluded(place, towardsB, 4 * caster.selfHitOffset(), fromB.distance(place)))
      continue;
    pairs.add(value, valuesOfB[static_cast<size_t>(pixel->y) * static_cast<size_t>(b.camera.lens.width) +
                               static_cast<size_t>(pixel->x)]);
  }
  if (pairs.n < kFewPairs) return {};
  const auto correlation = pairs.correlation();
  return correlation ? Agreement{pairs.n * *correlation, pairs.n} : Agreement{};
}

// Views nearest to view `a`, by the angle between directions from `middle`.
std::vector<size_t> neighboursOf(size_t a, std::span<const SmallView> views, const Point& middle) {
  const auto towardsA = capture::Viewpoint(views[a].camera).towards(middle);
  std::vector<size_t> others(views.size());
  std::iota(others.begin(), others.end(), size_t{0});
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(a));
  const auto cosine = [&](size_t b) {
    return dot(towardsA, capture::Viewpoint(views[b].camera).towards(middle));
  };
  const size_t count = std::min(kNeighbours, others.size());
  std::ranges::partial_sort(others, others.begin() + static_cast<std::ptrdiff_t>(count),
                            std::ranges::greater(), cosine);
  others.resize(count);
  return others;
}

// Agreement of nearby views in the brightness of the mesh's points: mean correlation over pairs of views;
// none if too few points are seen by two views.
std::optional<double> brightnessAgreement(std::span<const SmallView> views, const TriangleMesh& mesh,
                                          const RayCaster<AcquisitionSpace>& caster,
                                          const Progress& progress) {
  const Point middle = middleOf(mesh.positions);
  std::vector<std::vector<float>> values;
  for (const SmallView& view : views) values.push_back(logLuma(view.radiance));
  std::vector<Agreement> ofView(views.size());
  tbb::parallel_for(size_t{0}, views.size(), [&](size_t a) {
    progress.checkpoint();
    const auto points = seenPoints(views[a], values[a], mesh, caster);
    for (const size_t b : neighboursOf(a, views, middle)) {
      const Agreement agreement = agreementOf(views[a], points, views[b], values[b], caster);
      ofView[a].sum += agreement.sum;
      ofView[a].weight += agreement.weight;
    }
  });
  Agreement all;
  for (const Agreement& one : ofView) {
    all.sum += one.sum;
    all.weight += one.weight;
  }
  return all.weight > 0 ? std::optional(all.sum / all.weight) : std::nullopt;
}

// Largest pixel value of an integer format or of half floats, divided by exposure: an EXR is clipped at
// exactly this value, as single floats may exceed it. Infinite for other floating point, and for a bracket,
// whose shorter exposures extend the range.
double largestValue(const capture::Capture& capture, const capture::Frame& frame) {
  constexpr double kUnlimited = std::numeric_limits<double>::infinity(), kLargestHalf = 65504;
  if (!frame.further.empty()) return kUnlimited;
  const image::PictureFormat format = image::formatOf(frame.picture);
  if (format == image::PictureFormat::exr) return kLargestHalf / frame.exposure;
  if (format == image::PictureFormat::radiance ||
      image::readPictureHeader(capture.folder() / frame.picture).bits == 0)
    return kUnlimited;
  if (!capture.response) return 1 / frame.exposure;
  const auto& [r, g, b] = capture.response->exposure;
  return static_cast<double>(std::max({r.back(), g.back(), b.back()})) / frame.exposure;
}

ViewMeasures::MaskDifference maskDifference(const image::Mask& outline, const image::Mask& mask) {
  const image::Mask outlineCore = image::eroded(outline, kRim), maskCore = image::eroded(mask, kRim);
  double surplus = 0, missing = 0, all = 0;
  for (size_t i = 0; i < mask.inside.size(); ++i) {
    surplus += outlineCore.inside[i] && !mask.inside[i];
    missing += maskCore.inside[i] && !outline.inside[i];
    all += outline.inside[i];
  }
  all = std::max(1., all);
  return {surplus / all, missing / all};
}

} // namespace

ViewMeasures measure(const capture::Capture& capture, const SmallView& view) {
  ViewMeasures measures;
  measures.view = view.view;
  if (view.matte)
    measures.mask = maskDifference(view.outline, *view.matte);
  else
    measures.outlineContrast = outlineContrastOf(view);
  const double largest = largestValue(capture, capture.frames[view.frame]);
  double count = 0, full = 0;
  for (size_t i = 0; i < view.object().inside.size(); ++i) {
    if (!view.object().inside[i]) continue;
    const float* value = &view.radiance.values[3 * i];
    const auto peak = static_cast<double>(std::max({value[0], value[1], value[2]}));
    measures.brightest = std::max(measures.brightest, peak);
    full += std::isfinite(largest) && std::abs(peak - largest) <= 1e-4 * largest;
    ++count;
  }
  measures.clipped = count > 0 ? full / count : 0;
  const capture::Lens& lens = capture.views[view.view].camera.lens;
  const bool isWhole = view.object().width == lens.width && view.object().height == lens.height;
  measures.isThin =
      isWhole && count > 0 && std::ranges::none_of(image::eroded(view.object(), 1).inside, std::identity());
  measures.isBlack = std::ranges::none_of(view.radiance.values, [](float value) { return value > 0; });
  return measures;
}

std::vector<Finding> checkMasks(const capture::Capture& capture, std::span<const ViewMeasures> views) {
  std::vector<Offender> different;
  size_t checked = 0;
  for (const ViewMeasures& view : views) {
    if (!view.mask) continue;
    ++checked;
    const auto [surplus, missing] = *view.mask;
    if (std::max(surplus, missing) <= kMaskShare) continue;
    different.push_back(
        {surplus + missing,
         fmt::format("{} ({:.0f} % of the silhouette outside the mask, the mask {:.0f} % beyond it)",
                     capture.views[view.view].identity, 100 * surplus, 100 * missing)});
  }
  if (different.empty()) return {};
  const bool most = 2 * different.size() > checked;
  return {{most ? Severity::error : Severity::warning,
           fmt::format("the mesh and the masks differ in {} of {} views: {}", different.size(), checked,
                       worst(different))}};
}

std::optional<double> outlineContrast(std::span<const ViewMeasures> views) {
  std::vector<double> contrasts;
  for (const ViewMeasures& view : views)
    if (view.outlineContrast) contrasts.push_back(*view.outlineContrast);
  return contrasts.empty() ? std::nullopt : std::optional(median(contrasts));
}

std::vector<Finding> checkPlacement(double outlineContrast, std::span<const SmallView> views,
                                    const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& caster,
                                    const Progress& progress) {
  if (outlineContrast >= kSteepOutline) return {};
  const auto agreement = brightnessAgreement(views, mesh, caster, progress);
  if (outlineContrast >= kFlatOutline && agreement.value_or(0) >= kAgreeing) return {};
  const bool differ = agreement && *agreement < kDiffering;
  return {{differ ? Severity::error : Severity::warning,
           fmt::format(
               "the mesh {} lie where the photographs show it: they are {:.1f} times as steep at its outline "
               "as beside it (expected {} or more){}",
               differ ? "does not" : "may not", outlineContrast, kSteepOutline,
               agreement ? fmt::format(", and the brightness of its points correlates by {:.2f} between "
                                       "views (expected {})",
                                       *agreement, kAgreeing)
                         : "")}};
}

std::vector<Finding> checkThinness(std::span<const ViewMeasures> views) {
  if (views.empty() || !std::ranges::all_of(views, &ViewMeasures::isThin)) return {};
  return {{Severity::warning,
           fmt::format("the object is thinner than three pixels in all {} views, so that it mixes "
                       "with what lies around it",
                       views.size())}};
}

std::vector<Finding> checkExposures(const capture::Capture& capture, std::span<const ViewMeasures> views) {
  if (views.empty()) return {};
  if (std::ranges::all_of(views, &ViewMeasures::isBlack))
    return {{Severity::error, fmt::format("all {} photographs are black", views.size())}};
  std::vector<double> brightest;
  for (const ViewMeasures& view : views) brightest.push_back(view.brightest);
  const double usual = median(brightest);
  std::vector<Offender> black, white;
  for (const ViewMeasures& view : views) {
    const std::string& name = capture.views[view.view].identity;
    if (capture.lights.empty() && view.brightest < kBlackShare * usual) black.push_back({0, name});
    if (view.clipped > kClippedShare)
      white.push_back({view.clipped, fmt::format("{} ({:.0f} % of the object)", name, 100 * view.clipped)});
  }
  std::vector<Finding> findings;
  const auto tell = [&](const std::vector<Offender>& offenders, const char* what) {
    if (offenders.empty()) return;
    findings.push_back({Severity::warning, fmt::format("{} of {} photographs are {}: {}", offenders.size(),
                                                       views.size(), what, worst(offenders))});
  };
  tell(black, "black");
  tell(white, "overexposed");
  return findings;
}

std::vector<Finding> checkMattes(const capture::Capture& capture, const CheckEffort& effort,
                                 const Progress& progress) {
  std::vector<Finding> findings;
  for (std::string& warning : capture::surveyMasks(capture, false, progress, effort.views).warnings)
    findings.push_back({Finding::Severity::warning, std::move(warning)});
  return findings;
}

} // namespace surflect::validation
