#include "bench/accuracy/directions.h"

#include "render/surfels/cast_shadows.h"
#include "render/surfels/develop.h"
#include "render/surfels/frame.h"
#include "render/surfels/queries.h"
#include "warp/deform.h"

#include <memory>
#include <span>

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

class DirectionsRenderer : public method::Renderer {
public:
  DirectionsRenderer(const model::Model& model, DirectionsBack back)
      : model_(model), back_(back), description_{.method = "surfels",
                                                 .folder = model.folder,
                                                 .rig = model.rig,
                                                 .middle = model.middle,
                                                 .points = model.cloud.p0},
        cache_(model.files, size_t{1} << 30) {}

  const method::Description& describe() const override { return description_; }
  std::span<const method::Option> options() const override { return {}; }

  method::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>&, const Progress&,
                             method::FrameLayers) override {
    const SurfelCloud& rest = model_.cloud;
    const double step = warp::differenceStep(rest);
    const DeformedCloud cloud = warp::deform(rest, scene.warp);
    const splat::SplatRaster raster = surfels::look(scene.camera, rest, cloud);
    weights::QueryBatch batch = surfels::queriesAt(rest, cloud, raster.visible, scene.camera, scene.lights);
    if (surfels::castsShadows(model_, {})) {
      if (!occluders_) occluders_ = occludersOf(rest, *model_.levels);
      surfels::CastShadows(*occluders_, rest, scene).fill(cloud, raster.visible, batch);
    }
    for (size_t query = 0; query < batch.size(); ++query) {
      const size_t surfel = batch.surfels[query];
      const Mat3<double> frame = rotationOf<double>(rest.r0[surfel]);
      const Vec3<double> p0 = rest.p0[surfel].cast<double>().raw();
      const auto other = back_({frame, jacobianAt(scene.warp, p0, step) * frame});
      if (!other) continue;
      // L is orthogonal, so its transpose undoes the map of queriesAt.
      const Mat3<double> instead = *other * surfels::lookUpAt(rest, cloud, surfel).matrix().transpose();
      batch.towardsView[query] = rotated(instead, batch.towardsView[query]);
      for (size_t l = query * batch.lights; l < (query + 1) * batch.lights; ++l)
        batch.towardsLight[l] = rotated(instead, batch.towardsLight[l]);
    }
    shading::ShadingStats stats;
    return {surfels::developRadiance(raster, shading::shade(model_, batch, {}, cache_, stats)), {}};
  }

private:
  void configure(const method::Setting&) override {}

  const model::Model& model_;
  DirectionsBack back_;
  method::Description description_;
  codec::BlockCache cache_;
  std::optional<Occluders> occluders_; // found by the first frame that needs them
};

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

std::unique_ptr<method::Renderer> withDirections(const model::Model& model, DirectionsBack back) {
  return std::make_unique<DirectionsRenderer>(model, back);
}

} // namespace surflect::bench
