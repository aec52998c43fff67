#include "render/verify/queries_at_rest.h"

#include "surfel/base/evenly_spaced.h"

#include <algorithm>
#include <random>

namespace surflect::verify {

namespace {

constexpr uint8_t kSeenWell = 255; // code of a view that does not fade

// Random and unit, on the side of the normal.
Vec3<double> facing(const Vec3<double>& normal, std::mt19937& random) {
  std::normal_distribution<double> gaussian;
  const double x = gaussian(random), y = gaussian(random), z = gaussian(random);
  const Vec3<double> direction = Vec3<double>(x, y, z).normalized();
  return direction.dot(normal) < 0 ? Vec3<double>(-direction) : direction;
}

} // namespace

weights::QueryBatch randomQueries(const model::Model& model) {
  std::mt19937 random(39);
  weights::QueryBatch batch;
  batch.lights = model.rig.lights.empty() ? 0 : 1;
  for (const size_t i : evenlySpaced(model.cloud.size(), kTriedSurfels)) {
    const Vec3<double> normal = rotationOf<double>(model.cloud.r0[i]).col(2);
    batch.surfels.push_back(static_cast<uint32_t>(i));
    batch.towardsView.push_back(assume<Direction3<AcquisitionSpace>>(facing(normal, random)));
    if (batch.lights == 0) continue;
    batch.towardsLight.push_back(assume<Direction3<AcquisitionSpace>>(facing(normal, random)));
    batch.irradiance.push_back({1, 1, 1});
  }
  return batch;
}

MetQueries metQueries(const model::Model& model) {
  MetQueries met;
  met.batch.lights = model.rig.lights.empty() ? 0 : 1;
  const bool usesShadows = model.lightVisibility && model.interpolation.shadows;
  for (const size_t i : evenlySpaced(model.cloud.size(), kTriedSurfels)) {
    const auto fades = model.visibility.of(i);
    if (fades.empty()) continue;
    const auto view = static_cast<uint32_t>(std::ranges::max_element(fades) - fades.begin());
    if (fades[view] < kSeenWell) continue;
    const auto p0 = model.cloud.p0[i].cast<double>();
    met.view.push_back(view);
    met.column.push_back(0);
    met.batch.surfels.push_back(static_cast<uint32_t>(i));
    met.batch.towardsView.push_back(
        capture::Viewpoint<AcquisitionSpace>(model.rig.views[view].camera).towards(p0).cast<float>());
    if (met.batch.lights == 0) continue;
    const auto& lights = model.columns[view];
    met.column.back() = static_cast<uint32_t>(met.view.size() % lights.size());
    const uint32_t light = lights[met.column.back()];
    met.batch.towardsLight.push_back(capture::towardsLight(model.rig.lights[light], p0).cast<float>());
    met.batch.irradiance.push_back(capture::irradianceAt(model.rig.lights[light], p0));
    if (usesShadows)
      met.batch.reached.push_back(weights::VisibilityWeights::decode(model.lightVisibility->of(i)[light]));
  }
  return met;
}

} // namespace surflect::verify
