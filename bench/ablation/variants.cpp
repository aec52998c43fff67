#include "bench/ablation/variants.h"

#include "warp/deform.h"

#include <memory>

namespace surflect::bench {

namespace {

using Queries = std::function<model::Shaded(const model::QueryBatch& batch)>;
using Turned = std::function<void(const DeformedCloud& deformed, model::QueryBatch& batch)>;

// deform -> look once; then, by frame, queriesAt -> adjust -> shade -> develop.
evaluation::Renderer adjusted(const SplatView& view, const Turned& adjust, const Queries& shaded) {
  const auto deformed = std::make_shared<const DeformedCloud>(warp::deform(view.model.cloud, view.warp));
  const auto coverage = std::make_shared<const splat::SplatRaster>(
      surfels::look(view.camera, view.model.cloud, *deformed, view.options.splats, view.progress));
  return [=](std::span<const scene::ShotLight> lights) {
    model::QueryBatch batch = surfels::queriesAt(view.model.cloud, *deformed, coverage->visible, view.camera,
                                                 lights, view.progress);
    if (adjust) adjust(*deformed, batch);
    return surfels::developRadiance(*coverage, shaded(batch));
  };
}

Mat3<double> jacobianAt(const warp::Warp& warp, const Vec3<double>& x, double step) {
  const auto exact = warp.jacobian(x);
  return exact ? *exact : warp::centralDifferences(warp, x, Mat3<double>::Identity(), step);
}

Direction3<AcquisitionSpace> turned(const Mat3<double>& by, const Direction3<AcquisitionSpace>& direction) {
  const Vec3<double> d = by * direction.raw().cast<double>();
  return assume<Direction3<AcquisitionSpace, double>>(d.normalized()).cast<float>();
}

} // namespace

evaluation::Renderer withDirections(const SplatView& view, DirectionsBack back) {
  const double step = warp::differenceStep(view.model.cloud);
  const auto adjust = [=](const DeformedCloud& deformed, model::QueryBatch& batch) {
    const SurfelCloud& rest = view.model.cloud;
    for (size_t query = 0; query < batch.size(); ++query) {
      const size_t surfel = batch.surfels[query];
      const Mat3<double> frame = rotationOf<double>(rest.r0[surfel]);
      const Vec3<double> p0 = rest.p0[surfel].cast<double>().raw();
      const auto other = back({frame, jacobianAt(view.warp, p0, step) * frame});
      if (!other) continue;
      // L is orthogonal: its transpose takes what queriesAt has done back to object space.
      const Mat3<double> instead = *other * surfels::lookUpAt(rest, deformed, surfel).matrix().transpose();
      batch.towardsView[query] = turned(instead, batch.towardsView[query]);
      for (size_t l = query * batch.lights; l < (query + 1) * batch.lights; ++l)
        batch.towardsLight[l] = turned(instead, batch.towardsLight[l]);
    }
  };
  return adjusted(view, adjust, [=](const model::QueryBatch& batch) {
    codec::ShadingStats stats;
    return model::shade(view.model, batch, view.options.shade, view.cache, stats, view.progress);
  });
}

model::ShadingPlan blendedOverHull(const model::Model& model, const model::QueryBatch& batch,
                                   model::ShadingPlan plan) {
  codec::LightRows rows;
  std::vector<std::pair<uint32_t, uint32_t>> ranges; // of each query
  // Directional lights span one hull; the lights of others are seen in other directions from each surfel.
  std::optional<LightHull> hull;
  const bool isDistant = std::ranges::all_of(model.rig.lights, [](const capture::Light& light) {
    return std::holds_alternative<capture::DirectionalLight>(light.kind);
  });
  for (size_t query = 0; query < batch.size(); ++query) {
    const auto p0 = model.cloud.p0[batch.surfels[query]].cast<double>();
    if (!hull || !isDistant) {
      std::vector<Direction3<AcquisitionSpace>> towards;
      for (const capture::Light& light : model.rig.lights)
        towards.push_back(capture::towardsLight(light, p0).cast<float>());
      hull.emplace(towards);
    }
    const auto begin = static_cast<uint32_t>(rows.lights.size());
    for (size_t l = query * batch.lights; l < (query + 1) * batch.lights; ++l)
      for (const auto& [light, weight] : hull->weights(batch.towardsLight[l]))
        rows.add(light, weight * model::irradianceRatio(batch.irradiance[l],
                                                        capture::irradianceAt(model.rig.lights[light], p0)));
    ranges.emplace_back(begin, static_cast<uint32_t>(rows.lights.size()));
  }
  for (codec::ShadingOp& op : plan.ops) std::tie(op.rowBegin, op.rowEnd) = ranges[op.target];
  plan.rows = std::move(rows);
  return plan;
}

evaluation::Renderer withLightHull(const SplatView& view) {
  return adjusted(view, nullptr, [=](const model::QueryBatch& batch) {
    codec::ShadingStats stats;
    const model::ShadingPlan plan =
        blendedOverHull(view.model, batch, model::planShading(view.model, batch, view.options.shade));
    return model::Shaded{model::shade(plan, view.cache, stats, view.progress), plan.confidence, {}, {}};
  });
}

image::Image underAlphaOf(const image::Image& colors, const image::Image& other) {
  image::Image image = other;
  for (size_t pixel = 0; pixel < image.values.size(); pixel += 4) {
    const float scale = other.values[pixel + 3] / colors.values[pixel + 3];
    for (size_t c = 0; c < 3 && colors.values[pixel + 3] > 0; ++c)
      image.values[pixel + c] = scale * colors.values[pixel + c];
  }
  return image;
}

} // namespace surflect::bench
