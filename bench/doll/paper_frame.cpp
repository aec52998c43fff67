#include "bench/doll/paper_frame.h"

#include "srf/ulr/fallback_view.h"
#include "srf/ulr/ulr.h"
#include "surfel/base/error.h"
#include "surfel/math/bounds.h"
#include "warp/deform.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string_view>

namespace surflect::bench {

namespace {

using Acquired = Direction3<AcquisitionSpace, double>;

// p = Psi(p0); u, v by Eq. 6.
DeformedCloud deformed(const SurfelCloud& cloud, const warp::Warp& warp) {
  const double epsilon = warp::differenceStep(cloud);
  DeformedCloud result;
  for (size_t i = 0; i < cloud.size(); ++i) {
    const Vec3<double> p0 = cloud.p0[i].raw().cast<double>();
    const Mat3<double> frame = rotationOf<double>(cloud.r0[i]);
    const auto tangent = [&](int axis) -> Vec3<float> {
      const Vec3<double> step = epsilon * frame.col(axis);
      return ((warp.position(p0 + step) - warp.position(p0 - step)) / (2 * epsilon)).cast<float>();
    };
    const Vec3<float> p = warp.position(p0).cast<float>(), u = tangent(0), v = tangent(1);
    const bool alive = p.allFinite() && polarFrame(u, v).has_value();
    result.p.push_back(assume<Point3<ObjectSpace>>(p));
    result.u.push_back(assume<Direction3<ObjectSpace>>(u));
    result.v.push_back(assume<Direction3<ObjectSpace>>(v));
    result.handedness.push_back(alive ? Handedness::kept : Handedness::dead);
  }
  return result;
}

// Adds the time since the last call to a stage's.
class StageClock {
public:
  void finish(std::string_view stage) {
    const auto now = std::chrono::steady_clock::now();
    seconds[std::string(stage)] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

  std::map<std::string, double, std::less<>> seconds;

private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

// Radiance of one surfel after the other.
class PaperShader {
public:
  PaperShader(const model::Model& model, const model::QueryBatch& batch, const model::ShadeOptions& options,
              ResidentBlocks& blocks, StageClock& clock)
      : model_(model), batch_(batch), options_(options), blend_(model::lightBlend(model, options)),
        coverage_(directionsFromMiddle(model)), blocks_(blocks), clock_(clock),
        penalties_(model.rig.views.size()) {
    for (const capture::View& view : model.rig.views) viewpoints_.emplace_back(view.camera);
  }

  Rgb radiance(size_t query) {
    const uint32_t surfel = batch_.surfels[query];
    const auto p0 = model_.cloud.p0[surfel].cast<double>();
    const ulr::BlendSet views = blendViews(surfel, p0, batch_.towardsView[query]);
    clock_.finish("camera ulr");
    const std::vector<Answer> answers = weigh(query, p0);
    clock_.finish("light ulr");
    Vec3<double> sum = Vec3<double>::Zero();
    double all = 0, kept = 0;
    for (const auto& [view, share] : views) {
      const auto pixel = model_.rig.views[view].camera.project(p0);
      if (!pixel) continue;
      all += share;
      bool lost = false;
      for (const auto& [light, weight] : answers) {
        const auto seen = lookUp(view, light, pixel->x, pixel->y);
        lost = !seen;
        if (lost) break;
        sum += share * Vec3<double>(weight.r, weight.g, weight.b).cwiseProduct(*seen);
      }
      if (!lost) kept += share;
    }
    if (kept == 0) sum = stored(views, answers, p0);
    if (kept != 0) sum *= all / kept;
    clock_.finish("look-up");
    return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
  }

  size_t lookups() const { return lookups_; }
  // Of the query that radiance was asked for last.
  float leastPenalty() const { return *std::ranges::min_element(penalties_); }

private:
  static std::vector<Acquired> directionsFromMiddle(const model::Model& model) {
    const auto middle = middleOf(model.cloud.p0);
    std::vector<Acquired> directions;
    for (const capture::Light& light : model.rig.lights)
      directions.push_back(capture::towardsLight(light, middle));
    return directions;
  }

  // ULR over all views that see the surfel, and over those that stand in for them.
  ulr::BlendSet blendViews(uint32_t surfel, const Point3<AcquisitionSpace, double>& p0,
                           const Direction3<AcquisitionSpace>& towardsView) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const auto fades = model_.fades.of(surfel);
    float best = kInfinity;
    for (size_t view = 0; view < viewpoints_.size(); ++view) {
      penalties_[view] = kInfinity;
      if (fades[view] == 0) continue;
      const float angle =
          ulr::anglePenalty(viewpoints_[view].towards(p0).template cast<float>(), towardsView);
      penalties_[view] = angle / ulr::VisibilityWeights::decode(fades[view]);
      best = std::min(best, penalties_[view]);
    }
    if (!(best <= ulr::kFallbackFrom)) addStandIns(surfel, p0, towardsView);
    ulr::NearestCandidates nearest(options_.cameras);
    for (uint32_t view = 0; view < penalties_.size(); ++view) nearest.offer({view, penalties_[view]});
    return ulr::ulrWeights(nearest);
  }

  void addStandIns(uint32_t surfel, const Point3<AcquisitionSpace, double>& p0,
                   const Direction3<AcquisitionSpace>& towardsView) {
    const Vec3<double> normal = rotationOf<double>(model_.cloud.r0[surfel]).col(2);
    for (size_t view = 0; view < viewpoints_.size(); ++view) {
      const auto& camera = model_.rig.views[view].camera;
      const auto pixel = camera.project(p0);
      if (!pixel || !capture::contains(camera.lens, *pixel)) continue;
      const auto towards = viewpoints_[view].towards(p0);
      const float scale = ulr::fallbackScale(normal.dot(towards.raw()), ulr::borderFade(camera.lens, *pixel),
                                             ulr::VisibilityWeights::decode(model_.fades.of(surfel)[view]));
      const float angle = ulr::anglePenalty(towards.template cast<float>(), towardsView);
      penalties_[view] = std::min(penalties_[view], ulr::fallbackPenalty(angle, scale));
    }
  }

  // A captured light that answers for one of the query's, and what its radiance is multiplied by.
  struct Answer {
    uint32_t light;
    Rgb weight;
  };

  // ULR over all captured lights, for one light of the query after the other.
  std::vector<Answer> weigh(size_t query, const Point3<AcquisitionSpace, double>& p0) const {
    std::vector<Direction3<AcquisitionSpace>> towards;
    for (const capture::Light& light : model_.rig.lights)
      towards.push_back(capture::towardsLight(light, p0).template cast<float>());
    std::vector<Answer> answers;
    for (size_t l = 0; l < batch_.lights; ++l) {
      const size_t entry = query * batch_.lights + l;
      const Rgb now = batch_.irradiance[entry];
      for (const auto& [light, weight] : ulr::blendOfLights(towards, batch_.towardsLight[entry], blend_,
                                                            coverage_, batch_.extrapolation[l])) {
        answers.push_back({light, weight * model::irradianceRatio(
                                               now, capture::irradianceAt(model_.rig.lights[light], p0))});
      }
    }
    return answers;
  }

  // One reflectance image, bilinear; empty where it shows background.
  std::optional<Vec3<double>> lookUp(uint32_t view, uint32_t light, double x, double y) {
    ++lookups_;
    const codec::ViewHeader& header = blocks_.cache().views()[view].header();
    const double left = std::floor(x - 0.5), top = std::floor(y - 0.5);
    Vec3<double> sum = Vec3<double>::Zero();
    double weights = 0;
    for (const double tx : {left, left + 1})
      for (const double ty : {top, top + 1}) {
        const double weight = (1 - std::abs(x - 0.5 - tx)) * (1 - std::abs(y - 0.5 - ty));
        if (weight == 0) continue;
        const int column = static_cast<int>(std::clamp<double>(tx, 0, header.width - 1)),
                  row = static_cast<int>(std::clamp<double>(ty, 0, header.height - 1));
        const codec::Block* block = blocks_.at(view, column, row);
        if (!block) continue;
        const int8_t* e = block->texel(row % codec::blockSize * codec::blockSize + column % codec::blockSize);
        const float* a = block->light(light);
        for (int channel = 0; channel < 3; ++channel)
          for (int k = 0; k < block->stride; ++k)
            sum[channel] += weight * a[k] * static_cast<double>(e[channel * block->stride + k]);
        weights += weight;
      }
    if (weights == 0) return std::nullopt;
    return Vec3<double>(sum / weights);
  }

  // Where all views show background: what they store nearest to it.
  Vec3<double> stored(const ulr::BlendSet& views, std::span<const Answer> answers,
                      const Point3<AcquisitionSpace, double>& p0) {
    codec::LightRows rows;
    for (const auto& [light, weight] : answers) rows.add(light, weight);
    std::vector<codec::ShadingOp> ops;
    for (const auto& [view, share] : views)
      if (const auto pixel = model_.rig.views[view].camera.project(p0))
        ops.push_back({0, view, static_cast<float>(pixel->x), static_cast<float>(pixel->y), share, 0,
                       static_cast<uint32_t>(answers.size())});
    return codec::executeReference(ops, rows, 1, blocks_.cache())[0];
  }

  const model::Model& model_;
  const model::QueryBatch& batch_;
  const model::ShadeOptions& options_;
  ulr::LightBlend blend_;
  ulr::LightCoverage coverage_;
  ResidentBlocks& blocks_;
  StageClock& clock_;
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints_;
  std::vector<float> penalties_; // per view, of the current surfel
  size_t lookups_ = 0;
};

} // namespace

ResidentBlocks::ResidentBlocks(codec::BlockCache& cache) : cache_(cache) {
  for (const codec::ViewFile& view : cache.views()) blocks_.emplace_back(view.blockCount());
}

const codec::Block* ResidentBlocks::at(uint32_t view, int x, int y) {
  const auto number = cache_.views()[view].find({x / codec::blockSize, y / codec::blockSize});
  if (!number) return nullptr;
  auto& block = blocks_[view][*number];
  if (!block) block = cache_.get(view, *number);
  return block.get();
}

PaperFrame paperFrame(const model::Model& model, const warp::Warp& warp,
                      const capture::Camera<ObjectSpace>& camera, std::span<const scene::ShotLight> lights,
                      const surfels::FrameOptions& options, ResidentBlocks& blocks) {
  if (!model.isFullProduct || model::lightBlend(model, options.shade).foreshortened)
    throw Error("needs a full product of cameras and lights, and no foreshortening").in(model.folder);
  PaperFrame frame;
  StageClock clock;
  tbb::task_arena(1).execute([&] {
    const DeformedCloud cloud = deformed(model.cloud, warp);
    clock.finish("warp");
    const splat::SplatRaster coverage = surfels::look(camera, model.cloud, cloud, options.splats);
    frame.visible = coverage.visible.size();
    clock.finish("splat");
    const model::QueryBatch batch = surfels::queriesAt(model.cloud, cloud, coverage.visible, camera, lights);
    clock.finish("queries");
    PaperShader shader(model, batch, options.shade, blocks, clock);
    model::Shaded shaded;
    for (size_t query = 0; query < batch.size(); ++query) {
      shaded.radiance.push_back(shader.radiance(query));
      shaded.confidence.push_back(ulr::confidenceOf(shader.leastPenalty()));
    }
    frame.lookups = shader.lookups();
    frame.color = surfels::developRadiance(coverage, shaded);
    clock.finish("develop");
  });
  frame.seconds = std::move(clock.seconds);
  return frame;
}

} // namespace surflect::bench
