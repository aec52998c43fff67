#include "srf/model/shared_surface.h"

#include "srf/codec/block_cache.h"
#include "srf/shading/queue.h"
#include "srf/shading/taps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace surflect::model {

namespace {

using reflectance::PhotographArrays, reflectance::SurfelFrame, reflectance::SurfelSpace;

constexpr float kLeastSeen = 0.5f, kLeastLit = 0.9f; // least visibility weight and shadow state
constexpr float kLeastViewCosine = 0.1f, kLeastLightCosine = 0.05f;
constexpr size_t kSampled = 8000, kOfSampled = 64, kOfEach = 20; // surfels, and photographs of each
constexpr size_t kPart = 4096;                                   // look-ups that are planned together

Mat3<float> frameOf(const Model& model, uint32_t surfel) { return rotationOf<float>(model.cloud.r0[surfel]); }

// Photographs of surfels, from the view files.
class Photographer {
public:
  // The model must outlive this.
  Photographer(const Model& model, IsUsed isUsed, const Progress& progress)
      : model_(model), isUsed_(std::move(isUsed)), progress_(progress),
        cache_(model.files, size_t{256} << 20) {
    size_t columns = 0;
    for (size_t view = 0; view < model.rig.views.size(); ++view) {
      viewpoints_.emplace_back(model.rig.views[view].camera);
      projectors_.emplace_back(model.rig.views[view].camera);
      columns = std::max(columns, model.columns[view].size());
    }
    for (uint32_t column = 0; column < columns; ++column) rows_.add(column, {1, 1, 1});
  }

  // At most `most` photographs of each surfel, evenly chosen.
  PhotographArrays of(std::span<const uint32_t> surfels, size_t most) {
    std::vector<std::vector<Taken>> taken(surfels.size());
    tbb::parallel_for(size_t{0}, surfels.size(), [&](size_t i) { taken[i] = take(surfels[i], most); });
    PhotographArrays arrays;
    std::vector<shading::ShadingOp> ops;
    std::vector<Rgb> irradiance;
    for (const auto& ofSurfel : taken) {
      for (const Taken& each : ofSurfel) {
        arrays.add(each.towardsView, each.towardsLight, {});
        ops.push_back(each.op);
        irradiance.push_back(each.irradiance);
      }
      arrays.endSurfel();
    }
    arrays.reflectance = lookUp(ops);
    for (size_t i = 0; i < irradiance.size(); ++i)
      arrays.reflectance[i] = weights::irradianceRatio(arrays.reflectance[i], irradiance[i]);
    return arrays;
  }

private:
  // A photograph of a surfel, and the look-up of its pixel.
  struct Taken {
    Direction3<SurfelSpace> towardsView, towardsLight;
    Rgb irradiance;
    shading::ShadingOp op;
  };

  std::vector<Taken> take(uint32_t surfel, size_t most) const {
    struct Seen {
      uint32_t view;
      Direction3<SurfelSpace> towards;
      capture::Pixel pixel;
    };
    struct Lit {
      uint32_t light;
      Direction3<SurfelSpace> towards;
    };
    const auto p0 = model_.cloud.p0[surfel].cast<double>();
    const Rotation<SurfelSpace, AcquisitionSpace, float> inFrame(frameOf(model_, surfel).transpose());
    std::vector<Seen> seen;
    for (uint32_t view = 0; view < viewpoints_.size(); ++view) {
      if (weights::VisibilityWeights::decode(model_.visibility.of(surfel)[view]) < kLeastSeen) continue;
      const auto towards = inFrame(viewpoints_[view].towards(p0));
      const auto pixel = projectors_[view](p0);
      if (towards.z() >= kLeastViewCosine && pixel &&
          shading::storesTexel(model_.files[view], static_cast<float>(pixel->x),
                               static_cast<float>(pixel->y)))
        seen.push_back({view, towards.cast<float>(), *pixel});
    }
    std::vector<std::optional<Direction3<SurfelSpace>>> lit(model_.rig.lights.size());
    for (uint32_t light = 0; light < lit.size(); ++light) {
      const auto towards = inFrame(capture::towardsLight(model_.rig.lights[light], p0)).cast<float>();
      const float reached = weights::VisibilityWeights::decode(model_.lightVisibility->of(surfel)[light]);
      if (towards.z() >= kLeastLightCosine && reached >= kLeastLit) lit[light] = towards;
    }
    struct Pair {
      const Seen* seen;
      uint32_t column, light;
    };
    std::vector<Pair> pairs;
    for (const Seen& of : seen)
      for (uint32_t column = 0; column < model_.columns[of.view].size(); ++column)
        if (const uint32_t light = model_.columns[of.view][column]; lit[light] && isUsed_(of.view, light))
          pairs.push_back({&of, column, light});
    const size_t count = std::min(most, pairs.size());
    // Steps of the golden section take views and lights evenly; each surfel begins at another pair.
    auto step = static_cast<size_t>(0.618 * static_cast<double>(pairs.size()));
    while (std::gcd(step, pairs.size()) > 1) ++step;
    std::vector<Taken> taken;
    for (size_t i = 0; i < count; ++i) {
      const auto& [of, column, light] = pairs[(7919 * surfel + i * step) % pairs.size()];
      taken.push_back({of->towards,
                       *lit[light],
                       capture::irradianceAt(model_.rig.lights[light], p0),
                       {0, of->view, static_cast<float>(of->pixel.x), static_cast<float>(of->pixel.y), 1,
                        column, column + 1}});
    }
    return taken;
  }

  // Radiance of look-ups in turn.
  std::vector<Rgb> lookUp(std::span<shading::ShadingOp> ops) {
    std::vector<shading::ShadingPart> parts;
    for (size_t begin = 0; begin < ops.size(); begin += kPart) {
      const auto own = ops.subspan(begin, std::min(kPart, ops.size() - begin));
      for (uint32_t i = 0; i < own.size(); ++i) own[i].target = i;
      parts.push_back({own, &rows_, own.size()});
    }
    return shading::execute(parts, cache_, stats_, progress_);
  }

  const Model& model_;
  const IsUsed isUsed_;
  const Progress& progress_;
  codec::BlockCache cache_;
  shading::ShadingStats stats_;
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints_;
  std::vector<capture::Projector<AcquisitionSpace>> projectors_;
  weights::LightRows rows_; // row k: column k alone
};

// Mean over lights and channels of the irradiance at the middle of the object.
float meanIrradiance(const Model& model) {
  float sum = 0;
  for (const capture::Light& light : model.rig.lights)
    sum += weights::brightness(capture::irradianceAt(light, model.middle)) / 3;
  return sum / static_cast<float>(model.rig.lights.size());
}

reflectance::SharingOptions optionsFor(const Model& model) {
  reflectance::SharingOptions options;
  options.white = static_cast<float>(model.white) / meanIrradiance(model);
  return options;
}

bool useAll(size_t /*view*/, size_t /*light*/) { return true; }

// Places and frames of surfels.
struct PlacedSurfels {
  std::vector<Point3<AcquisitionSpace>> places;
  std::vector<SurfelFrame> frames;

  PlacedSurfels(const Model& model, std::span<const uint32_t> surfels) {
    for (const uint32_t surfel : surfels) {
      places.push_back(model.cloud.p0[surfel]);
      frames.emplace_back(frameOf(model, surfel));
    }
  }
  reflectance::SurfelPlaces view() const { return {places, frames}; }
};

} // namespace

bool canShare(const Model& model) {
  return model.alpha.empty() && model.lightVisibility && model.cloud.size() > 0 && meanIrradiance(model) > 0;
}

SharedSample shareSample(const Model& model, const Progress& progress) {
  assert(canShare(model));
  std::vector<uint32_t> surfels;
  const size_t step = std::max(size_t{1}, model.cloud.size() / kSampled);
  for (size_t surfel = step / 2; surfel < model.cloud.size(); surfel += step)
    surfels.push_back(static_cast<uint32_t>(surfel));
  const PhotographArrays photographs = Photographer(model, useAll, progress).of(surfels, kOfSampled);
  const PlacedSurfels placed(model, surfels);
  return {std::move(surfels),
          shareReflectance(photographs.view(), placed.view(), optionsFor(model), progress)};
}

reflectance::SharedReflectance refitSample(const Model& model, const SharedSample& sample,
                                           const IsUsed& isUsed, const Progress& progress) {
  const PhotographArrays photographs = Photographer(model, isUsed, progress).of(sample.surfels, kOfSampled);
  return refitReflectance(sample.shared, photographs.view(), optionsFor(model), progress);
}

reflectance::SharedReflectance spreadOver(const Model& model, const SharedSample& sample,
                                          const Progress& progress) {
  Photographer photographer(
      model, [](size_t, size_t) { return true; }, progress);
  std::vector<uint32_t> all(model.cloud.size());
  std::iota(all.begin(), all.end(), 0u);
  const PlacedSurfels sampled(model, sample.surfels), placed(model, all);
  return spreadReflectance(
      sample.shared, sampled.view(), placed.view(),
      [&](size_t begin, size_t end) {
        return photographer.of(std::span(all).subspan(begin, end - begin), kOfEach);
      },
      progress);
}

} // namespace surflect::model
