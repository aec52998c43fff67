#include "render/surfels/reference.h"

#include "render/surfels/cast_shadows.h"
#include "render/surfels/develop.h"
#include "render/surfels/queries.h"
#include "srf/shading/reference.h"
#include "surfel/base/error.h"
#include "warp/deform.h"

#include <tbb/task_arena.h>

#include <chrono>

namespace surflect::surfels {

namespace {

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

// Direction and irradiance of a light at a deformed surfel, appended to a batch.
struct AddLight {
  const Point3<ObjectSpace, double>& p;
  const LookUp<double>& L;
  weights::QueryBatch& batch;

  void add(const Direction3<ObjectSpace, double>& towards, Rgb irradiance,
           weights::LightExtrapolation beyond) {
    batch.towardsLight.push_back(L(towards).cast<float>());
    batch.irradiance.push_back(irradiance);
    batch.extrapolation.push_back(beyond);
  }
  void operator()(const scene::ShotDirectionalLight& light) {
    add(light.towards, light.irradiance, light.extrapolation);
  }
  void operator()(const scene::ShotPointLight& light) {
    const auto toLight = light.position - p;
    add(normalized(toLight), static_cast<float>(1 / dot(toLight, toLight)) * light.intensity,
        light.extrapolation);
  }
  void operator()(const scene::ShotEnvironment&) {
    throw Error("the reference frame takes directional and point lights only");
  }
};

// (2)
weights::QueryBatch queriesOf(const SurfelCloud& rest, const DeformedCloud& cloud,
                              std::span<const uint32_t> surfels, const capture::Camera<ObjectSpace>& camera,
                              std::span<const scene::ShotLight> lights) {
  const capture::Viewpoint<ObjectSpace> viewer(camera);
  weights::QueryBatch batch;
  batch.lights = lights.size();
  for (const uint32_t surfel : surfels) {
    const LookUp<double> L = lookUpAt(rest, cloud, surfel);
    const auto p = cloud.p[surfel].cast<double>();
    batch.surfels.push_back(surfel);
    batch.towardsView.push_back(L(viewer.towards(p)).cast<float>());
    for (const scene::ShotLight& light : lights) std::visit(AddLight{p, L, batch}, light);
  }
  batch.extrapolation.resize(lights.size()); // the same for every surfel
  return batch;
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

} // namespace

ReferenceFrame referenceFrame(const model::Model& model, const warp::Warp& warp,
                              const capture::Camera<ObjectSpace>& camera,
                              std::span<const scene::ShotLight> lights, const FrameOptions& options,
                              codec::BlockCache& cache) {
  if (castsShadows(model, options.shade, options.shadows))
    throw Error("the reference frame casts no shadows").in(model.folder);
  ReferenceFrame frame;
  tbb::task_arena(1).execute([&] {
    ReferenceClock clock;
    const DeformedCloud cloud = deformed(model.cloud, warp);
    clock.finish("warp");
    const splat::SplatRaster coverage = look(camera, model.cloud, cloud, options.splats);
    frame.visible = coverage.visible.size();
    clock.finish("splat");
    const weights::QueryBatch batch = queriesOf(model.cloud, cloud, coverage.visible, camera, lights);
    clock.finish("queries");
    weights::ShadeOptions exact = options.shade;
    exact.weightError = 0;
    const shading::ShadingPlan plan = shading::planReference(model, batch, exact); // (3)
    for (const shading::ShadingOp& op : plan.ops)
      frame.lookups += plan.rows.weightsOf(op.rowBegin, op.rowEnd).size();
    clock.finish("ulr");
    shading::Shaded shaded;
    shaded.alpha = plan.alpha;
    shaded.confidence = plan.confidence;
    for (const Eigen::Vector3d& radiance : shading::shadeReference(plan, cache)) {
      const Eigen::Vector3f rgb = radiance.cast<float>();
      shaded.radiance.push_back({rgb[0], rgb[1], rgb[2]});
    }
    clock.finish("look-up");
    if (exact.interpolation == weights::Interpolation::paper) shaded.confidence.clear();
    frame.color = developRadiance(coverage, shaded); // (4)
    clock.finish("develop");
    frame.seconds = std::move(clock.seconds);
  });
  return frame;
}

} // namespace surflect::surfels
