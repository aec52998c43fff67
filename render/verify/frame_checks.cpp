#include "render/verify/frame_checks.h"

#include "render/evaluation/label.h"
#include "render/evaluation/measure.h"
#include "render/surfels/aovs.h"
#include "render/surfels/cast_shadows.h"
#include "render/surfels/queries.h"
#include "render/verify/model_checks.h"
#include "srf/image/image.h"
#include "srf/shading/plan.h"
#include "srf/weights/light_weights.h"
#include "surfel/base/text.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace surflect::verify {

namespace {

constexpr size_t kShownPlaces = 3;
constexpr double kLitCosine = 0.05; // of a light that is asked for; behind the surface it does not matter
constexpr double kRingRadius = 9;   // pixels
constexpr int kLeastOverlay = 640;  // pixels along the longer side

double toDegrees(double radians) { return radians * 180 / std::numbers::pi; }
double percent(size_t part, size_t whole) {
  return whole > 0 ? 100 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}

// Results of the checks at each visible surfel; one entry per surfel of raster.visible.
struct VisibleFlags {
  std::vector<uint8_t> isFolded, isUnseen, isUnmatched, lacksLight, lacksView, isShared;
  std::vector<size_t> unmatched; // lights
  std::vector<float> viewGap, lightGap, lookUpError,
      weightError; // radians; lightGap -1 where no light is asked

  explicit VisibleFlags(size_t count)
      : isFolded(count), isUnseen(count), isUnmatched(count), lacksLight(count), lacksView(count),
        isShared(count), unmatched(count), viewGap(count), lightGap(count, -1), lookUpError(count),
        weightError(count) {}
  const std::vector<uint8_t>& of(size_t flag) const { // in the order of kFlagColors
    const std::array<const std::vector<uint8_t>*, 5> all{&isFolded, &isUnseen, &isUnmatched, &lacksLight,
                                                         &lacksView};
    return *all[flag];
  }
};

size_t countOf(const std::vector<uint8_t>& flags) {
  return static_cast<size_t>(std::ranges::count(flags, uint8_t{1}));
}

class FrameChecker {
public:
  FrameChecker(const model::Model& model, const scene::Scene& scene, const surfels::FrameOptions& options,
               surfels::FrameWorkspace& workspace, const Bounds& bounds, const Progress& progress)
      : model_(model), scene_(scene), options_(options), workspace_(workspace), bounds_(bounds),
        progress_(progress), color_(surfels::renderFrame(model, scene, options, workspace, progress).color),
        cloud_(workspace.deformed), visible_(visibleIn(model, scene, options, workspace, progress).visible),
        flags_(visible_.size()) {}

  FrameFindings findings() {
    ask();
    addWarpChecks();
    addAnswerChecks();
    addPixelChecks();
    return {checks_, overlay()};
  }

private:
  // Splats that the frame shows. The pixels of a grid are drawn without; surfels that splats would show stand
  // for its visible corners, which the frame asks about.
  static const splat::SplatRaster& visibleIn(const model::Model& model, const scene::Scene& scene,
                                             const surfels::FrameOptions& options,
                                             surfels::FrameWorkspace& workspace, const Progress& progress) {
    if (model.grid)
      workspace.raster =
          surfels::look(scene.camera, model.cloud, workspace.deformed, options.splats, progress);
    return workspace.raster;
  }

  // Queries of all visible surfels, and what their plans answer.
  void ask() {
    const surfels::LitScene lit = surfels::litScene(scene_, options_.environmentError, model_, options_.shade,
                                                    workspace_.environments, progress_);
    const DeformedCloud ofOptions = surfels::withTangents(options_.tangents, cloud_, model_);
    const DeformedCloud& tangents = options_.tangents == surfels::Tangents::polar ? cloud_ : ofOptions;
    batch_ = surfels::queriesAt(model_.cloud, tangents, visible_, scene_.camera, lit.scene.lights,
                                lit.environments, progress_);
    if (surfels::castsShadows(model_, options_.shade, options_.shadows) && batch_.lights > 0) {
      if (!workspace_.occluders) workspace_.occluders = occludersOf(model_.cloud, *model_.levels);
      surfels::CastShadows(*workspace_.occluders, model_.cloud, lit.scene, progress_)
          .fill(cloud_, visible_, batch_);
    }
    plan();
    measureDirections();
  }

  void plan() {
    if (visible_.empty()) return;
    weights::ShadeOptions shade = options_.shade;
    shade.usesAlpha = false; // weights of look-ups sum to 1 before they are multiplied by alpha
    shading::ShadingPlanner planner(model_, batch_, shade);
    const size_t step = planner.queriesPerPlan();
    tbb::parallel_for(tbb::blocked_range<size_t>(0, (visible_.size() + step - 1) / step, 1),
                      [&](const tbb::blocked_range<size_t>& range) {
                        shading::ShadingPlan plan;
                        for (size_t k = range.begin(); k < range.end(); ++k) {
                          progress_.checkNowAndThen(k);
                          readPlan(planner, k * step, std::min(visible_.size(), (k + 1) * step), plan);
                        }
                      });
  }

  // Flags of the queries [begin, end). A plan counts what fails; single plans then tell where.
  void readPlan(shading::ShadingPlanner& planner, size_t begin, size_t end, shading::ShadingPlan& plan) {
    planner.plan(begin, end, plan);
    const std::vector<double> sums = weightSums(plan);
    for (size_t i = begin; i < end; ++i) {
      flags_.weightError[i] = static_cast<float>(verify::weightError(plan, sums, i - begin, batch_.lights));
      const auto shares =
          std::span(plan.tableShares).subspan((i - begin) * plan.tablesPerPlace, plan.tablesPerPlace);
      const float sum = std::accumulate(shares.begin(), shares.end(), 0.f);
      flags_.isShared[i] = 2 * sum > static_cast<float>(shares.size());
    }
    if (plan.unseen == 0 && plan.unmatchedShadows == 0) return;
    if (end - begin == 1) {
      flags_.isUnseen[begin] = plan.unseen > 0;
      flags_.isUnmatched[begin] = plan.unmatchedShadows > 0;
      flags_.unmatched[begin] = plan.unmatchedShadows;
      return;
    }
    const size_t middle = begin + (end - begin) / 2;
    readPlan(planner, begin, middle, plan);
    readPlan(planner, middle, end, plan);
  }

  void measureDirections() {
    std::vector<capture::Viewpoint<AcquisitionSpace>> views;
    for (const capture::View& view : model_.rig.views) views.emplace_back(view.camera);
    const capture::Viewpoint<ObjectSpace> viewer(scene_.camera);
    viewLimit_ = nearAngle(viewDirections(model_));
    lightLimit_ = model_.rig.lights.empty() ? 0 : nearAngle(weights::lightDirections(model_));
    size_t majority = 0;
    for (const Handedness handedness : cloud_.handedness) majority += handedness == Handedness::kept;
    const bool isMirrored = 2 * majority < live();
    tbb::parallel_for(size_t{0}, visible_.size(), [&](size_t i) {
      const uint32_t surfel = visible_[i];
      const auto p0 = model_.cloud.p0[surfel].cast<double>();
      flags_.isFolded[i] = (cloud_.handedness[surfel] == Handedness::mirrored) != isMirrored;
      const LookUp<double> lookUp = surfels::lookUpAt(model_.cloud, cloud_, surfel);
      const Vec3<double> asked = batch_.towardsView[i].raw().cast<double>();
      const auto exact = lookUp(viewer.towards(cloud_.p[surfel].cast<double>()));
      flags_.lookUpError[i] = static_cast<float>((exact.raw() - asked).norm());
      const auto fades = model_.visibility.of(surfel);
      double gap = std::numbers::pi;
      for (size_t view = 0; view < views.size(); ++view)
        if (fades[view] > 0)
          gap = std::min(gap, angleBetween(views[view].towards(p0).raw(), asked.normalized()));
      flags_.viewGap[i] = static_cast<float>(gap);
      flags_.lacksView[i] = !flags_.isUnseen[i] && gap > viewLimit_;
      const Vec3<double> normal = rotationOf<double>(model_.cloud.r0[surfel]).col(2);
      for (size_t l = 0; l < batch_.lights; ++l) {
        const Vec3<double> light =
            batch_.towardsLight[i * batch_.lights + l].raw().cast<double>().normalized();
        if (batch_.extrapolationOf(l) == weights::LightExtrapolation::fade) continue; // gets dark instead
        if (normal.dot(light) < kLitCosine) continue;
        double nearest = std::numbers::pi;
        for (const capture::Light& captured : model_.rig.lights)
          nearest = std::min(nearest, angleBetween(capture::towardsLight(captured, p0).raw(), light));
        flags_.lightGap[i] = std::max(flags_.lightGap[i], static_cast<float>(nearest));
      }
      flags_.lacksLight[i] = static_cast<double>(flags_.lightGap[i]) > lightLimit_;
    });
  }

  size_t live() const {
    return cloud_.size() - static_cast<size_t>(std::ranges::count(cloud_.handedness, Handedness::dead));
  }

  FlaggedPlace placeAt(uint32_t surfel, double figure) const {
    FlaggedPlace place = placeOf(model_, surfel, figure);
    Vec3<double> p = cloud_.p[surfel].raw().cast<double>();
    if (cloud_.handedness[surfel] == Handedness::dead)
      p = scene_.warp.position(place.rest); // where it would be
    if (!p.allFinite()) return place;
    const auto pixel = scene_.camera.project(assume<Point3<ObjectSpace, double>>(p));
    if (pixel && capture::contains(scene_.camera.lens, *pixel)) place.pixel = pixel;
    return place;
  }
  // The entry of visible surfels of the largest figure.
  std::vector<FlaggedPlace> worstOf(const std::vector<float>& figures, double unit = 1) const {
    if (figures.empty()) return {};
    const auto worst = std::ranges::max_element(figures);
    return {placeAt(visible_[static_cast<size_t>(worst - figures.begin())], unit * double{*worst})};
  }
  std::vector<FlaggedPlace> someOf(const std::vector<uint8_t>& flags) const {
    std::vector<uint32_t> found;
    for (size_t i = 0; i < flags.size(); ++i)
      if (flags[i]) found.push_back(visible_[i]);
    std::vector<FlaggedPlace> places;
    for (const size_t i : evenlySpaced(found.size(), kShownPlaces)) places.push_back(placeAt(found[i], 0));
    return places;
  }

  void addWarpChecks() {
    std::vector<uint32_t> dead, minority;
    size_t mirrored = 0;
    for (const Handedness handedness : cloud_.handedness) mirrored += handedness == Handedness::mirrored;
    const Handedness odd = 2 * mirrored > live() ? Handedness::kept : Handedness::mirrored;
    double stretch = 1;
    FlaggedPlace stretched;
    for (uint32_t i = 0; i < cloud_.size(); ++i) {
      if (cloud_.handedness[i] == Handedness::dead) dead.push_back(i);
      if (cloud_.handedness[i] == odd) minority.push_back(i);
    }
    for (const uint32_t i : visible_) {
      const double own =
          surfels::stretchOf(cloud_.u[i].raw().cast<double>(), cloud_.v[i].raw().cast<double>());
      if (!(own <= stretch)) stretch = own, stretched = placeAt(i, own);
    }
    const auto placesOf = [&](const std::vector<uint32_t>& surfels) {
      std::vector<FlaggedPlace> places;
      for (const size_t i : evenlySpaced(surfels.size(), kShownPlaces))
        places.push_back(placeAt(surfels[i], 0));
      return places;
    };
    add("collapsed", percent(dead.size(), cloud_.size()),
        fmt::format("{} of {} surfels have no place or no area", dead.size(), cloud_.size()), placesOf(dead));
    add("folded", percent(minority.size(), cloud_.size()),
        fmt::format("{} of {} surfels are turned inside out{}", minority.size(), cloud_.size(),
                    odd == Handedness::kept ? "; the warp mirrors the others, which is no fault" : ""),
        placesOf(minority));
    add("stretch", stretch, fmt::format("the largest stretch of a visible splat is {:.3g} : 1", stretch),
        stretch > 1 ? std::vector{stretched} : std::vector<FlaggedPlace>{});
  }

  void addAnswerChecks() {
    const size_t count = visible_.size();
    if (count == 0) {
      for (const char* rule : {"unseen", "views_extrapolated", "lights_extrapolated", "shadows_unmatched",
                               "shared", "frame_weights", "frame_look_up"})
        checks_.push_back(inapplicable(rule, "no surfel is visible"));
      return;
    }
    const size_t unseen = countOf(flags_.isUnseen), farViews = countOf(flags_.lacksView);
    add("unseen", percent(unseen, count),
        fmt::format("{} of {} visible surfels are answered by views that do not see them", unseen, count),
        someOf(flags_.isUnseen));
    add("views_extrapolated", percent(farViews, count),
        fmt::format(
            "{} of {} visible surfels are more than {:.0f} degrees from a camera that sees them; the largest "
            "gap is {:.0f} degrees",
            farViews, count, toDegrees(viewLimit_), toDegrees(largestSeenGap())),
        worstSeenGap());
    addLightChecks();
    if (model_.shared) {
      const size_t shared = countOf(flags_.isShared);
      add("shared", percent(shared, count),
          fmt::format(
              "tables answer more than half of {} of {} visible surfels under lamps, hence photographs "
              "of other surfels too",
              shared, count),
          someOf(flags_.isShared));
    } else {
      checks_.push_back(inapplicable("shared", "the model has no tables"));
    }
    const float weight = *std::ranges::max_element(flags_.weightError);
    add("frame_weights", double{weight}, fmt::format("weights sum to 1 within {:.1e}", weight),
        worstOf(flags_.weightError));
    const float lookUp = *std::ranges::max_element(flags_.lookUpError);
    add("frame_look_up", double{lookUp}, fmt::format("directions err by at most {:.1e}", lookUp),
        worstOf(flags_.lookUpError));
  }

  std::vector<float> seenGaps() const {
    std::vector<float> gaps = flags_.viewGap;
    for (size_t i = 0; i < gaps.size(); ++i)
      if (flags_.isUnseen[i]) gaps[i] = 0; // counted as unseen
    return gaps;
  }
  double largestSeenGap() const { return double{std::ranges::max(seenGaps())}; }
  std::vector<FlaggedPlace> worstSeenGap() const { return worstOf(seenGaps(), 180 / std::numbers::pi); }

  void addLightChecks() {
    if (model_.rig.lights.empty()) {
      checks_.push_back(inapplicable("lights_extrapolated", "captured under fixed illumination"));
      checks_.push_back(inapplicable("shadows_unmatched", "captured under fixed illumination"));
      return;
    }
    const size_t asked =
        flags_.lightGap.size() - static_cast<size_t>(std::ranges::count(flags_.lightGap, -1.f));
    if (batch_.lights == 0) {
      checks_.push_back(
          inapplicable("lights_extrapolated", "no directional light, point light or key light"));
    } else if (asked == 0) {
      checks_.push_back(
          inapplicable("lights_extrapolated", "no light reaches the front of a visible surfel"));
    } else {
      const size_t farLights = countOf(flags_.lacksLight);
      add("lights_extrapolated", percent(farLights, asked),
          fmt::format(
              "{} of {} lit surfels are asked for light more than {:.0f} degrees from a captured one; the "
              "largest gap is {:.0f} degrees",
              farLights, asked, toDegrees(lightLimit_), toDegrees(double{std::ranges::max(flags_.lightGap)})),
          worstOf(flags_.lightGap, 180 / std::numbers::pi));
    }
    if (batch_.reached.empty()) {
      checks_.push_back(
          inapplicable("shadows_unmatched", "shadow states are not used by this interpolation"));
    } else {
      const size_t unmatched = std::accumulate(flags_.unmatched.begin(), flags_.unmatched.end(), size_t{0}),
                   all = visible_.size() * batch_.lights;
      add("shadows_unmatched", percent(unmatched, all),
          fmt::format(
              "for {} of {} visible surfels and lights, most photographs have another shadow state than is "
              "asked for",
              unmatched, all),
          someOf(flags_.isUnmatched));
    }
  }

  void addPixelChecks() {
    const auto broken = static_cast<size_t>(
        std::ranges::count_if(color_.values, [](float value) { return !std::isfinite(value); }));
    add("finite", static_cast<double>(broken),
        broken == 0 ? fmt::format("all {} x {} pixels are finite", color_.width, color_.height)
                    : fmt::format("{} values of pixels are not finite", broken),
        {});
    const capture::Lens& lens = scene_.camera.lens;
    double largest = 0;
    FlaggedPlace worst;
    for (const uint32_t i : visible_) {
      const auto p = cloud_.p[i].cast<double>();
      const double depth =
          lens.model == capture::Lens::Model::orthographic ? 1 : -scene_.camera.cameraFromWorld(p).z();
      const double pixels =
          p.raw().cwiseAbs().maxCoeff() * 0x1p-24 * std::max(lens.focalX, lens.focalY) / depth;
      if (!(pixels <= largest)) largest = pixels, worst = placeAt(i, pixels);
    }
    if (visible_.empty())
      checks_.push_back(inapplicable("frame_precision", "no surfel is visible"));
    else
      add("frame_precision", largest, fmt::format("places are rounded by at most {:.1e} pixels", largest),
          {worst});
  }

  void add(const char* rule, double figure, std::string finding, std::vector<FlaggedPlace> places) {
    checks_.push_back(judged(rule, figure, bounds_, std::move(finding), std::move(places)));
  }

  image::Image overlay() const {
    const size_t channels = kFlagColors.size();
    std::vector<float> values(visible_.size() * channels);
    for (size_t i = 0; i < visible_.size(); ++i)
      for (size_t flag = 0; flag < channels; ++flag) values[i * channels + flag] = flags_.of(flag)[i];
    const image::Image shares = splat::blend(workspace_.raster, values, static_cast<int>(channels));
    image::PercentileCounter luma;
    for (size_t i = 0; i < color_.values.size(); i += 4)
      if (color_.values[i + 3] > 0.5f) luma.add(color_.values[i + 1]);
    const double white = luma.percentile(0.99);
    image::Image grey(color_.width, color_.height, 3);
    for (size_t pixel = 0; pixel < grey.values.size() / 3; ++pixel) {
      const float* rgba = &color_.values[4 * pixel];
      const float mean = (rgba[0] + rgba[1] + rgba[2]) / 3;
      for (size_t k = 0; k < 3; ++k) grey.values[3 * pixel + k] = std::isfinite(mean) ? mean : 0;
    }
    image::Image srgb = evaluation::srgbEncoded(evaluation::applyExposure(grey, white > 0 ? 1 / white : 1));
    for (size_t pixel = 0; pixel < srgb.values.size() / 3; ++pixel) {
      const float alpha = std::clamp(color_.values[4 * pixel + 3], 0.f, 1.f);
      float* own = &srgb.values[3 * pixel];
      for (size_t k = 0; k < 3; ++k) own[k] = 0.08f * (1 - alpha) + (0.15f * alpha + 0.75f * own[k]);
      float left = 0.75f; // of the pixel, for flags that are less grave
      for (size_t flag = 0; flag < channels; ++flag) {
        const float share =
            std::min(left, 0.75f * std::clamp(shares.values[pixel * channels + flag], 0.f, 1.f));
        const Rgb color = colorOf(kFlagColors[flag].color);
        own[0] += share * (color.r - own[0]), own[1] += share * (color.g - own[1]),
            own[2] += share * (color.b - own[2]);
        left -= share;
      }
    }
    return marked(srgb);
  }

  static Rgb colorOf(std::string_view hex) {
    const auto channel = [&](size_t at) {
      int value = 0;
      std::from_chars(hex.data() + at, hex.data() + at + 2, value, 16);
      return static_cast<float>(value) / 255;
    };
    return {channel(1), channel(3), channel(5)};
  }

  // Magnifies the picture, and rings the places of broken checks.
  image::Image marked(const image::Image& small) const {
    const int factor = std::max(1, (kLeastOverlay + std::max(small.width, small.height) - 1) /
                                       std::max(small.width, small.height));
    image::Image large(small.width * factor, small.height * factor, 3);
    for (int y = 0; y < large.height; ++y)
      for (int x = 0; x < large.width; ++x)
        std::ranges::copy(small.at(x / factor, y / factor), large.at(x, y).begin());
    int number = 0;
    for (const Check& check : checks_) {
      if (check.verdict != Verdict::broken) continue;
      const std::vector<capture::Pixel> apart = placesApart(check, factor);
      for (const capture::Pixel& pixel : apart) ring(large, pixel);
      ++number;
      if (!apart.empty()) label(large, apart.front(), std::to_string(number));
    }
    return large;
  }

  // Places of a check in the magnified picture; of rings that would overlap, the first.
  static std::vector<capture::Pixel> placesApart(const Check& check, int factor) {
    std::vector<capture::Pixel> apart;
    for (const FlaggedPlace& place : check.places) {
      if (!place.pixel) continue;
      const capture::Pixel pixel{factor * place.pixel->x, factor * place.pixel->y};
      if (std::ranges::none_of(apart, [&](const capture::Pixel& other) {
            return std::hypot(pixel.x - other.x, pixel.y - other.y) < 3 * kRingRadius;
          }))
        apart.push_back(pixel);
    }
    return apart;
  }

  static void ring(image::Image& picture, const capture::Pixel& middle) {
    const int reach = static_cast<int>(kRingRadius) + 3;
    for (int dy = -reach; dy <= reach; ++dy)
      for (int dx = -reach; dx <= reach; ++dx) {
        const int x = static_cast<int>(middle.x) + dx, y = static_cast<int>(middle.y) + dy;
        if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) continue;
        const double off = std::abs(std::hypot(dx, dy) - kRingRadius);
        if (off <= 2.5) std::ranges::fill(picture.at(x, y), off < 1.2 ? 1.f : 0.f);
      }
  }

  // White on black, above and right of a ring.
  static void label(image::Image& picture, const capture::Pixel& middle, const std::string& text) {
    const int x = static_cast<int>(middle.x + kRingRadius),
              y = static_cast<int>(middle.y - kRingRadius) - 2 * evaluation::kLabelHeight;
    for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {2, 2}})
      evaluation::drawLabel(picture, x + dx, y + dy, text, {0, 0, 0}, 2);
    evaluation::drawLabel(picture, x, y, text, {1, 1, 1}, 2);
  }

  const model::Model& model_;
  const scene::Scene& scene_;
  const surfels::FrameOptions options_;
  surfels::FrameWorkspace& workspace_;
  const Bounds& bounds_;
  const Progress& progress_;
  const image::Image color_;
  const DeformedCloud& cloud_;
  const std::vector<uint32_t>& visible_;
  VisibleFlags flags_;
  weights::QueryBatch batch_;
  double viewLimit_ = 0, lightLimit_ = 0; // radians
  std::vector<Check> checks_;
};

} // namespace

FrameFindings frameChecks(const model::Model& model, const scene::Scene& scene, surfels::FrameOptions options,
                          surfels::FrameWorkspace& workspace, const Bounds& bounds,
                          const Progress& progress) {
  options.surfelSize = 0;
  options.surfelsPerQuery = 1;
  options.aovs.clear();
  return FrameChecker(model, scene, options, workspace, bounds, progress).findings();
}

} // namespace surflect::verify
