#include "render/lightfield/common/photograph_weights.h"

#include "srf/weights/environment_map.h"
#include "srf/weights/light_blend.h"
#include "surfel/base/error.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>

namespace surflect::lightfield {

namespace {

using Towards = Direction3<AcquisitionSpace, double>;
using Place = Point3<AcquisitionSpace, double>;

// Captured lights as seen from the object's middle.
struct LightsSeen {
  std::vector<Towards> towards; // unit
  std::vector<Rgb> irradiance;
};

LightsSeen lightsFrom(std::span<const capture::Light> lights, const Place& middle) {
  LightsSeen seen;
  for (const capture::Light& light : lights) {
    seen.towards.push_back(capture::towardsLight(light, middle));
    seen.irradiance.push_back(capture::irradianceAt(light, middle));
  }
  return seen;
}

// Index of the captured light in this direction.
std::optional<size_t> lightAt(std::span<const Towards> lights, const Towards& towards) {
  constexpr double kSameLight = 0.5e-10; // penalty of 1e-5 radians
  const size_t nearest = nearestLight(lights, towards);
  if (weights::anglePenalty(lights[nearest], towards) > kSameLight) return std::nullopt;
  return nearest;
}

// Irradiance that each captured light stands for, E_l.
std::vector<Rgb> assignedIrradiance(const LightsSeen& seen, const capture::Light& light,
                                    weights::LightExtrapolation extrapolation, const Place& middle) {
  std::vector<Rgb> assigned(seen.towards.size());
  const Towards towards = capture::towardsLight(light, middle);
  const Rgb irradiance = capture::irradianceAt(light, middle);
  if (const auto same = lightAt(seen.towards, towards)) {
    assigned[*same] = irradiance;
    return assigned;
  }
  std::vector<Direction3<AcquisitionSpace>> rounded;
  for (const Towards& captured : seen.towards) rounded.push_back(captured.cast<float>());
  const weights::LightExtrapolationFade coverage(seen.towards);
  for (const auto& [l, weight] :
       weights::blendOfLights(rounded, towards.cast<float>(), {}, coverage, extrapolation))
    assigned[l] = weight * irradiance;
  return assigned;
}

// Sum of the irradiance of all texels that are nearest to each captured light.
std::vector<Rgb>
irradianceByNearestLight(std::span<const Towards> lights, const weights::EnvironmentMap& environment,
                         const Rotation<AcquisitionSpace, EnvironmentSpace>& acquisitionFromEnvironment,
                         const Progress& progress) {
  const std::vector<weights::EnvironmentLight>& texels = environment.texels;
  std::vector<uint32_t> nearest(texels.size());
  const Mat3<double> rotation = acquisitionFromEnvironment.matrix();
  tbb::parallel_for(size_t{0}, texels.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    const auto towards = assume<Towards>(rotation * texels[i].towards.raw().cast<double>());
    nearest[i] = static_cast<uint32_t>(nearestLight(lights, towards));
  });
  std::vector<Vec3<double>> sums(lights.size(), Vec3<double>::Zero()); // in double, for millions of texels
  for (size_t i = 0; i < texels.size(); ++i)
    sums[nearest[i]] += Vec3<double>(texels[i].irradiance.r, texels[i].irradiance.g, texels[i].irradiance.b);
  std::vector<Rgb> irradiance;
  for (const Vec3<double>& sum : sums)
    irradiance.push_back(
        {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])});
  return irradiance;
}

Rgb dividedBy(const Rgb& a, const Rgb& b) { return {a.r / b.r, a.g / b.g, a.b / b.b}; }

// Assigns the irradiance of one light of a shot.
struct Assigning {
  const LightsSeen& seen;
  const Place& middle;
  const Progress& progress;

  std::vector<Rgb> operator()(const scene::ShotDirectionalLight& light) const {
    const capture::DirectionalLight kind{assume<Towards>(light.towards.raw()), light.irradiance,
                                         light.irradianceGradient};
    return assignedIrradiance(seen, {{}, {}, kind}, light.extrapolation, middle);
  }
  std::vector<Rgb> operator()(const scene::ShotPointLight& light) const {
    const capture::PointLight kind{assume<Place>(light.position.raw()), light.intensity};
    return assignedIrradiance(seen, {{}, {}, kind}, light.extrapolation, middle);
  }
  std::vector<Rgb> operator()(const scene::ShotEnvironment& light) const {
    const Rotation<AcquisitionSpace, EnvironmentSpace> acquisitionFromEnvironment(
        light.objectFromEnvironment.matrix());
    std::vector<Rgb> assigned =
        irradianceByNearestLight(seen.towards, *light.map, acquisitionFromEnvironment, progress);
    for (Rgb& irradiance : assigned) irradiance = light.strength * irradiance;
    return assigned;
  }
};

} // namespace

size_t nearestLight(std::span<const Direction3<AcquisitionSpace, double>> lights,
                    const Direction3<AcquisitionSpace, double>& towards) {
  assert(!lights.empty());
  size_t nearest = 0;
  for (size_t l = 1; l < lights.size(); ++l)
    if (dot(lights[l], towards) > dot(lights[nearest], towards)) nearest = l;
  return nearest;
}

std::vector<Rgb> photographWeights(std::span<const capture::Light> captured,
                                   const Point3<AcquisitionSpace, double>& middle,
                                   std::span<const scene::ShotLight> lights, const Progress& progress) {
  const LightsSeen seen = lightsFrom(captured, middle);
  std::vector<Rgb> weights(captured.size());
  for (size_t i = 0; i < lights.size(); ++i) {
    const std::vector<Rgb> assigned = std::visit(Assigning{seen, middle, progress}, lights[i]);
    for (size_t l = 0; l < captured.size(); ++l) {
      weights[l] = weights[l] + dividedBy(assigned[l], seen.irradiance[l]);
      for (const float weight : {weights[l].r, weights[l].g, weights[l].b})
        if (!std::isfinite(weight))
          throw Error::mismatch("a finite number", numberText(weight))
              .at(fmt::format("light[{}]: weight of captured light {}", i, captured[l].name));
    }
  }
  return weights;
}

capture::Photograph weightedSum(std::span<const capture::Photograph> photographs,
                                std::span<const Rgb> weights) {
  assert(!photographs.empty() && photographs.size() == weights.size());
  const int width = photographs[0].alpha.width, height = photographs[0].alpha.height;
  capture::Photograph sum{image::Image(width, height, 3), image::Image(width, height, 1)};
  for (const capture::Photograph& photograph : photographs) {
    assert(photograph.alpha.width == width && photograph.alpha.height == height);
    sum.hasMatte |= photograph.hasMatte;
  }
  tbb::parallel_for(0, height, [&](int row) {
    const size_t begin = static_cast<size_t>(row) * static_cast<size_t>(width);
    for (size_t i = begin; i < begin + static_cast<size_t>(width); ++i) {
      float& alpha = sum.alpha.values[i];
      for (const capture::Photograph& photograph : photographs)
        alpha = std::max(alpha, photograph.alpha.values[i]);
      if (!(alpha > 0)) continue;
      std::array<double, 3> color{};
      for (size_t p = 0; p < photographs.size(); ++p) {
        const double share = double{photographs[p].alpha.values[i]} / alpha; // 1 where all alphas are equal
        const float* radiance = &photographs[p].radiance.values[3 * i];
        color[0] += share * (double{weights[p].r} * radiance[0]);
        color[1] += share * (double{weights[p].g} * radiance[1]);
        color[2] += share * (double{weights[p].b} * radiance[2]);
      }
      for (size_t c = 0; c < 3; ++c) sum.radiance.values[3 * i + c] = static_cast<float>(color[c]);
    }
  });
  return sum;
}

} // namespace surflect::lightfield
