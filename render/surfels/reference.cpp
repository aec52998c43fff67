#include "render/surfels/reference.h"

#include "render/surfels/develop.h"
#include "render/surfels/queries.h"
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

namespace surflect::surfels {

namespace {

using Place = Point3<AcquisitionSpace, double>;
using Towards = Direction3<AcquisitionSpace>; // unit

// (1)
DeformedCloud deformed(const SurfelCloud& cloud, const warp::Warp& warp) {
  const double e = warp::differenceStep(cloud);
  DeformedCloud result;
  for (size_t i = 0; i < cloud.size(); ++i) {
    const Vec3<double> p0 = cloud.p0[i].raw().cast<double>();
    const Mat3<double> R0 = rotationOf<double>(cloud.r0[i]);
    const auto tangent = [&](int axis) -> Vec3<float> {
      const Vec3<double> step = e * R0.col(axis);
      return ((warp.position(p0 + step) - warp.position(p0 - step)) / (2 * e)).cast<float>();
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

// A light as a surfel sees it.
struct Incident {
  Towards towards; // L l
  Rgb irradiance;
  ulr::LightExtrapolation extrapolation;
};

struct Query {
  Place p0;
  uint32_t surfel;
  Towards towardsView; // L v
  std::vector<Incident> lights;
};

Incident incident(const scene::ShotDirectionalLight& light, const Point3<ObjectSpace, double>&,
                  const LookUp<double>& L) {
  return {L(light.towards).cast<float>(), light.irradiance, light.extrapolation};
}

Incident incident(const scene::ShotPointLight& light, const Point3<ObjectSpace, double>& p,
                  const LookUp<double>& L) {
  const auto toLight = light.position - p;
  return {L(normalized(toLight)).cast<float>(),
          static_cast<float>(1 / dot(toLight, toLight)) * light.intensity, light.extrapolation};
}

Incident incident(const scene::ShotEnvironment&, const Point3<ObjectSpace, double>&, const LookUp<double>&) {
  throw Error("the reference frame takes directional and point lights only");
}

// (2)
Query queryAt(const SurfelCloud& rest, const DeformedCloud& cloud, uint32_t surfel,
              const capture::Viewpoint<ObjectSpace>& viewer, std::span<const scene::ShotLight> lights) {
  const LookUp<double> L = lookUpAt(rest, cloud, surfel);
  const auto p = cloud.p[surfel].cast<double>();
  Query query{rest.p0[surfel].cast<double>(), surfel, L(viewer.towards(p)).cast<float>(), {}};
  for (const scene::ShotLight& light : lights)
    query.lights.push_back(std::visit([&](const auto& kind) { return incident(kind, p, L); }, light));
  return query;
}

// Adds the time since the last call to a stage.
class ReferenceClock {
public:
  void finish(const char* stage) {
    const auto now = std::chrono::steady_clock::now();
    seconds[stage] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
  }

  std::map<std::string, double> seconds;

private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

class Shader {
public:
  Shader(const model::Model& model, const shading::ShadeOptions& options, DecodedBlocks& blocks)
      : model_(model), options_(options), blend_(shading::lightBlend(model, options)),
        coverage_(towardsLights(model)), blocks_(blocks) {
    for (const capture::View& view : model.rig.views) viewpoints_.emplace_back(view.camera);
  }

  // A captured view and its w_c, or a captured light and its w_k E / E_k.
  struct WeightedView {
    uint32_t view;
    float weight;
    capture::Pixel pixel; // of p0
  };
  struct WeightedLight {
    uint32_t light;
    Rgb weight;
  };

  // (3), (5). Sets `least` to the smallest penalty.
  std::vector<WeightedView> weightViews(const Query& query, float& least) const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const auto visibility = model_.visibility.of(query.surfel);
    std::vector<float> penalties(viewpoints_.size(), kInfinity);
    for (size_t view = 0; view < viewpoints_.size(); ++view)
      if (visibility[view] != 0)
        penalties[view] = angleTo(view, query) / ulr::VisibilityWeights::decode(visibility[view]);
    if (!(*std::ranges::min_element(penalties) <= ulr::kFallbackFrom)) addFallbackViews(query, penalties);
    least = *std::ranges::min_element(penalties);
    ulr::NearestCandidates nearest(options_.cameras);
    for (uint32_t view = 0; view < penalties.size(); ++view) nearest.offer({view, penalties[view]});
    std::vector<WeightedView> views;
    for (const auto& [view, weight] : ulr::ulrWeights(nearest))
      if (const auto pixel = model_.rig.views[view].camera.project(query.p0))
        views.push_back({view, weight, *pixel});
    return views;
  }

  // (4), (5), for each light of the query
  std::vector<WeightedLight> weightLights(const Query& query) const {
    std::vector<Towards> captured;
    for (const capture::Light& light : model_.rig.lights)
      captured.push_back(capture::towardsLight(light, query.p0).cast<float>());
    std::vector<WeightedLight> lights;
    for (const auto& [towards, E, extrapolation] : query.lights)
      for (const auto& [k, weight] : ulr::blendOfLights(captured, towards, blend_, coverage_, extrapolation))
        lights.push_back(
            {k, weight * shading::irradianceRatio(E, capture::irradianceAt(model_.rig.lights[k], query.p0))});
    return lights;
  }

  // Mean alpha of the views' photographs at p0.
  float alpha(std::span<const WeightedView> views) const {
    float sum = 0, weights = 0;
    for (const WeightedView& c : views) {
      sum += c.weight * alphaAt(c);
      weights += c.weight;
    }
    return weights > 0 ? sum / weights : 0;
  }

  // (6), premultiplied by alpha. Views that show background at p0 are left out; if all do, each is looked up
  // at the nearest point where its photographs show the object.
  Rgb radiance(std::vector<WeightedView> views, std::span<const WeightedLight> lights) {
    for (WeightedView& c : views) c.weight *= alphaAt(c);
    std::erase_if(views, [](const WeightedView& c) { return c.weight == 0; });
    if (std::ranges::all_of(views, [&](const WeightedView& c) { return isBackground(c); }))
      for (WeightedView& c : views) c.pixel = nearestStored(c.view, c.pixel);
    Vec3<double> sum = Vec3<double>::Zero();
    double all = 0, kept = 0;
    for (const WeightedView& c : views) {
      all += c.weight;
      if (isBackground(c)) continue;
      kept += c.weight;
      for (const auto& [k, weight] : lights) {
        ++lookups_;
        sum += c.weight * Vec3<double>(weight.r, weight.g, weight.b).cwiseProduct(lookUp(c.view, k, c.pixel));
      }
    }
    if (kept != 0) sum *= all / kept;
    return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
  }

  size_t lookups() const { return lookups_; }

private:
  static std::vector<Direction3<AcquisitionSpace, double>> towardsLights(const model::Model& model) {
    std::vector<Direction3<AcquisitionSpace, double>> directions;
    for (const capture::Light& light : model.rig.lights)
      directions.push_back(capture::towardsLight(light, middleOf(model.cloud.p0)));
    return directions;
  }

  // 1 in a model of an opaque object.
  float alphaAt(const WeightedView& c) const {
    return model_.alpha.empty()
               ? 1
               : model_.alpha[c.view].at(static_cast<float>(c.pixel.x), static_cast<float>(c.pixel.y));
  }
  float angleTo(size_t view, const Query& query) const {
    return ulr::anglePenalty(viewpoints_[view].towards(query.p0).cast<float>(), query.towardsView);
  }

  // Lowers the penalties of views that can serve as fallback views (fallback_view.h).
  void addFallbackViews(const Query& query, std::span<float> penalties) const {
    const Vec3<double> n0 = rotationOf<double>(model_.cloud.r0[query.surfel]).col(2);
    for (size_t view = 0; view < viewpoints_.size(); ++view) {
      const auto& camera = model_.rig.views[view].camera;
      const auto pixel = camera.project(query.p0);
      if (!pixel || !capture::contains(camera.lens, *pixel)) continue;
      const float scale = ulr::fallbackScale(
          n0.dot(viewpoints_[view].towards(query.p0).raw()), ulr::borderFade(camera.lens, *pixel),
          ulr::VisibilityWeights::decode(model_.visibility.of(query.surfel)[view]));
      penalties[view] = std::min(penalties[view], ulr::fallbackPenalty(angleTo(view, query), scale));
    }
  }

  // Calls visit(weight, block, texel) for the texels around a pixel that show the object.
  template <class Visit> void visitTexels(uint32_t c, capture::Pixel pixel, Visit visit) {
    const codec::ViewHeader& header = blocks_.view(c).header();
    const double left = std::floor(pixel.x - 0.5), top = std::floor(pixel.y - 0.5);
    for (const double tx : {left, left + 1})
      for (const double ty : {top, top + 1}) {
        const double weight = (1 - std::abs(pixel.x - 0.5 - tx)) * (1 - std::abs(pixel.y - 0.5 - ty));
        if (weight == 0) continue;
        const int x = static_cast<int>(std::clamp<double>(tx, 0, header.width - 1)),
                  y = static_cast<int>(std::clamp<double>(ty, 0, header.height - 1));
        if (const codec::Block* block = blocks_.at(c, x, y))
          visit(weight, *block, y % codec::blockSize * codec::blockSize + x % codec::blockSize);
      }
  }

  bool isBackground(const WeightedView& c) {
    bool found = false;
    visitTexels(c.view, c.pixel, [&](double, const codec::Block&, int) { found = true; });
    return !found;
  }

  // I_ck, bilinear over the texels that show the object; at least one must.
  Vec3<double> lookUp(uint32_t c, uint32_t k, capture::Pixel pixel) {
    ++lookups_;
    Vec3<double> sum = Vec3<double>::Zero();
    double weights = 0;
    visitTexels(c, pixel, [&](double weight, const codec::Block& block, int texel) {
      const int8_t* e = block.texel(texel);
      const float* a = block.light(k);
      for (int channel = 0; channel < 3; ++channel)
        for (int term = 0; term < block.stride; ++term)
          sum[channel] += weight * a[term] * static_cast<double>(e[channel * block.stride + term]);
      weights += weight;
    });
    return sum / weights;
  }

  // The point nearest to a pixel between the texel centres of a stored block; the pixel if none is stored.
  capture::Pixel nearestStored(uint32_t c, capture::Pixel pixel) const {
    const codec::ViewFile& file = blocks_.view(c);
    const codec::ViewHeader& header = file.header();
    const auto clamped = [](double x, int block, int size) {
      return std::clamp(x, block * codec::blockSize + 0.5,
                        std::min((block + 1) * codec::blockSize, size) - 0.5);
    };
    const capture::Pixel from{std::clamp(pixel.x, 0.5, header.width - 0.5),
                              std::clamp(pixel.y, 0.5, header.height - 0.5)};
    double least = std::numeric_limits<double>::infinity();
    for (uint32_t number = 0; number < file.blockCount(); ++number) {
      const codec::BlockPosition block = file.position(number);
      const capture::Pixel here{clamped(from.x, block.x, header.width),
                                clamped(from.y, block.y, header.height)};
      const double distance = std::hypot(here.x - from.x, here.y - from.y);
      if (distance >= least) continue;
      least = distance;
      pixel = here;
    }
    return pixel;
  }

  const model::Model& model_;
  const shading::ShadeOptions& options_;
  ulr::LightBlend blend_;
  ulr::LightExtrapolationFade coverage_;
  DecodedBlocks& blocks_;
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints_;
  size_t lookups_ = 0;
};

} // namespace

DecodedBlocks::DecodedBlocks(codec::BlockCache& cache) : cache_(cache) {
  for (const codec::ViewFile& view : cache.views()) blocks_.emplace_back(view.blockCount());
}

const codec::Block* DecodedBlocks::at(uint32_t view, int x, int y) {
  const auto number = cache_.views()[view].find({x / codec::blockSize, y / codec::blockSize});
  if (!number) return nullptr;
  auto& block = blocks_[view][*number];
  if (!block) block = cache_.get(view, *number);
  return block.get();
}

ReferenceFrame referenceFrame(const model::Model& model, const warp::Warp& warp,
                              const capture::Camera<ObjectSpace>& camera,
                              std::span<const scene::ShotLight> lights, const FrameOptions& options,
                              DecodedBlocks& blocks) {
  if (!model.isFullProduct || shading::lightBlend(model, options.shade).foreshortened)
    throw Error("needs a full product of cameras and lights, and no foreshortening").in(model.folder);
  ReferenceFrame frame;
  tbb::task_arena(1).execute([&] {
    ReferenceClock clock;
    const DeformedCloud cloud = deformed(model.cloud, warp);
    clock.finish("warp");
    const splat::SplatRaster coverage = look(camera, model.cloud, cloud, options.splats);
    frame.visible = coverage.visible.size();
    clock.finish("splat");
    const capture::Viewpoint<ObjectSpace> viewer(camera);
    Shader shader(model, options.shade, blocks);
    shading::Shaded shaded;
    for (const uint32_t surfel : coverage.visible) {
      const Query query = queryAt(model.cloud, cloud, surfel, viewer, lights);
      clock.finish("queries");
      float leastPenalty = 0;
      const auto views = shader.weightViews(query, leastPenalty);
      const auto weights = shader.weightLights(query);
      clock.finish("ulr");
      shaded.radiance.push_back(shader.radiance(views, weights));
      if (!model.alpha.empty()) shaded.alpha.push_back(shader.alpha(views));
      shaded.confidence.push_back(ulr::confidenceOf(leastPenalty));
      clock.finish("look-up");
    }
    frame.lookups = shader.lookups();
    frame.color = developRadiance(coverage, shaded); // (7)
    clock.finish("develop");
    frame.seconds = std::move(clock.seconds);
  });
  return frame;
}

} // namespace surflect::surfels
