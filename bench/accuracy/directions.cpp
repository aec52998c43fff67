#include "bench/accuracy/directions.h"

#include "warp/deform.h"

#include <memory>

namespace surflect::bench {

namespace {

// L = R0 (u-bar, v-bar, s n-bar)^T  [Weyrich 2005, Eq. 10], s = -1 where the warp mirrors.
std::optional<Mat3<double>> lookUp(const WarpedFrame& frame,
                                   const std::optional<OrthonormalFrame<double>>& bar) {
  if (!bar) return std::nullopt;
  return LookUp<double>(frame.rest, *bar, frame.warped.determinant() < 0 ? -1 : 1).matrix();
}

Direction3<AcquisitionSpace> rotated(const Mat3<double>& by, const Direction3<AcquisitionSpace>& direction) {
  const Vec3<double> d = by * direction.raw().cast<double>();
  return assume<Direction3<AcquisitionSpace, double>>(d.normalized()).cast<float>();
}

Mat3<double> jacobianAt(const warp::Warp& warp, const Vec3<double>& x, double step) {
  const auto exact = warp.jacobian(x);
  return exact ? *exact : warp::centralDifferences(warp, x, Mat3<double>::Identity(), step);
}

} // namespace

std::optional<Mat3<double>> byPolarFactor(const WarpedFrame& frame) {
  return lookUp(frame, polarFrame<double>(frame.warped.col(0), frame.warped.col(1)));
}

std::optional<Mat3<double>> byBisector(const WarpedFrame& frame) {
  return lookUp(frame, bisectorFrame<double>(frame.warped.col(0), frame.warped.col(1)));
}

std::optional<Mat3<double>> byGramSchmidt(const WarpedFrame& frame) {
  const auto polar = polarFrame<double>(frame.warped.col(0), frame.warped.col(1));
  if (!polar) return std::nullopt;
  const Vec3<double> uBar = frame.warped.col(0).normalized();
  return lookUp(frame, OrthonormalFrame<double>{uBar, polar->n.cross(uBar), polar->n});
}

std::optional<Mat3<double>> byInverseJacobian(const WarpedFrame& frame) {
  if (!polarFrame<double>(frame.warped.col(0), frame.warped.col(1)) || frame.warped.determinant() == 0)
    return std::nullopt;
  return frame.rest * frame.warped.inverse();
}

evaluation::Renderer withDirections(const model::Model& model, const warp::Warp& warp,
                                    const capture::Camera<ObjectSpace>& camera,
                                    const shading::ShadeOptions& options, codec::BlockCache& cache,
                                    DirectionsBack back) {
  const SurfelCloud& rest = model.cloud;
  const double step = warp::differenceStep(rest);
  const auto cloud = std::make_shared<const DeformedCloud>(warp::deform(rest, warp));
  const auto coverage = std::make_shared<const splat::SplatRaster>(surfels::look(camera, rest, *cloud));
  return [=, &model, &rest, &warp, &options, &cache](std::span<const scene::ShotLight> lights) {
    shading::QueryBatch batch = surfels::queriesAt(rest, *cloud, coverage->visible, camera, lights);
    for (size_t query = 0; query < batch.size(); ++query) {
      const size_t surfel = batch.surfels[query];
      const Mat3<double> frame = rotationOf<double>(rest.r0[surfel]);
      const Vec3<double> p0 = rest.p0[surfel].cast<double>().raw();
      const auto other = back({frame, jacobianAt(warp, p0, step) * frame});
      if (!other) continue;
      // L is orthogonal, so its transpose undoes the map of queriesAt.
      const Mat3<double> instead = *other * surfels::lookUpAt(rest, *cloud, surfel).matrix().transpose();
      batch.towardsView[query] = rotated(instead, batch.towardsView[query]);
      for (size_t l = query * batch.lights; l < (query + 1) * batch.lights; ++l)
        batch.towardsLight[l] = rotated(instead, batch.towardsLight[l]);
    }
    shading::ShadingStats stats;
    return surfels::developRadiance(*coverage, shading::shade(model, batch, options, cache, stats));
  };
}

} // namespace surflect::bench
