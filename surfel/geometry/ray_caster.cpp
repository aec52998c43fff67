#include "surfel/geometry/ray_caster.h"

#include "surfel/math/bounds.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

namespace surflect {

template <class Space> struct RayCaster<Space>::Scene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Vec3<double> center;
  double extent = 0;

  ~Scene() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  // Empty where float arithmetic, which squares what it gets, cannot follow; such a ray meets nothing.
  std::optional<RTCRay> ray(const Point3<Space, double>& origin,
                            const Direction3<Space, double>& direction) const {
    constexpr double farthest = 1e18;
    const Vec3<double> fromCenter = origin.raw() - center;
    if (!fromCenter.allFinite() || fromCenter.cwiseAbs().maxCoeff() > farthest ||
        !direction.raw().allFinite())
      return std::nullopt;
    const Vec3<float> o = fromCenter.template cast<float>(), d = direction.raw().template cast<float>();
    RTCRay ray{};
    ray.org_x = o[0], ray.org_y = o[1], ray.org_z = o[2];
    ray.dir_x = d[0], ray.dir_y = d[1], ray.dir_z = d[2];
    ray.tfar = std::numeric_limits<float>::infinity();
    ray.mask = ~0u;
    return ray;
  }
};

namespace {

// Throws Error if Embree's last call failed, and Cancelled if the progress stopped it.
void requireSuccess(RTCDevice device, const Progress& progress) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_CANCELLED) progress.checkpoint();
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw Error("the mesh does not fit into memory");
  if (error != RTC_ERROR_NONE) throw Error("Embree fails (error " + std::to_string(error) + ")");
}

struct WindingContext {
  RTCIntersectContext embree; // first, for Embree hands on a pointer to it
  int winding = 0;
};

// Counts what the ray meets, and lets it pass.
void countCrossing(const RTCFilterFunctionNArguments* crossing) {
  const RTCRay ray = rtcGetRayFromRayN(crossing->ray, crossing->N, 0);
  const RTCHit hit = rtcGetHitFromHitN(crossing->hit, crossing->N, 0);
  const float along = ray.dir_x * hit.Ng_x + ray.dir_y * hit.Ng_y + ray.dir_z * hit.Ng_z;
  reinterpret_cast<WindingContext*>(crossing->context)->winding += along > 0 ? 1 : -1;
  crossing->valid[0] = 0;
}

bool goesOn(void* progress, double) {
  const auto& cancelled = static_cast<const Progress*>(progress)->cancelled;
  return !cancelled || !cancelled();
}

} // namespace

template <class Space> RayCaster<Space>::RayCaster(const Mesh<Space>& mesh, const Progress& progress) {
  auto scene = std::make_unique<Scene>();
  const Eigen::AlignedBox3d box = boundsOf(mesh.positions);
  scene->center = box.center();
  scene->extent = box.sizes().maxCoeff();
  scene->device = rtcNewDevice(nullptr);
  requireSuccess(scene->device, progress);
  scene->scene = rtcNewScene(scene->device);
  rtcSetSceneFlags(scene->scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  const RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcAttachGeometry(scene->scene, geometry);
  rtcReleaseGeometry(geometry); // the scene's now
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.positions.size()));
  requireSuccess(scene->device, progress);
  for (const auto& p : mesh.positions) {
    const Vec3<float> recentred = (p.template cast<double>().raw() - scene->center).template cast<float>();
    vertices = std::copy_n(recentred.data(), 3, vertices);
  }
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(uint32_t), mesh.triangles.size());
  requireSuccess(scene->device, progress);
  std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * sizeof mesh.triangles[0]);
  rtcCommitGeometry(geometry);
  rtcSetSceneProgressMonitorFunction(scene->scene, goesOn, const_cast<Progress*>(&progress));
  rtcCommitScene(scene->scene);
  rtcSetSceneProgressMonitorFunction(scene->scene, nullptr, nullptr);
  requireSuccess(scene->device, progress);
  scene_ = std::move(scene);
}

template <class Space> RayCaster<Space>::~RayCaster() = default;

template <class Space>
auto RayCaster<Space>::firstHit(const Point3<Space, double>& origin,
                                const Direction3<Space, double>& direction) const -> std::optional<Hit> {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  const std::optional<RTCRay> ray = scene_->ray(origin, direction);
  if (!ray) return std::nullopt;
  RTCRayHit query{*ray, {}};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v};
}

template <class Space>
bool RayCaster<Space>::occluded(const Point3<Space, double>& origin,
                                const Direction3<Space, double>& direction, double offset,
                                double distance) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  std::optional<RTCRay> ray = scene_->ray(origin, direction);
  if (!ray) return false;
  ray->tnear = static_cast<float>(offset);
  ray->tfar = static_cast<float>(distance);
  rtcOccluded1(scene_->scene, &context, &*ray);
  return ray->tfar < 0; // Embree's sign of a hit
}

template <class Space>
int RayCaster<Space>::winding(const Point3<Space, double>& origin,
                              const Direction3<Space, double>& direction) const {
  WindingContext context;
  rtcInitIntersectContext(&context.embree);
  context.embree.filter = countCrossing;
  std::optional<RTCRay> ray = scene_->ray(origin, direction);
  if (!ray) return 0;
  rtcOccluded1(scene_->scene, &context.embree, &*ray);
  return context.winding;
}

template <class Space> double RayCaster<Space>::selfHitOffset() const { return 1e-5 * scene_->extent; }

template class RayCaster<AcquisitionSpace>;
template class RayCaster<ObjectSpace>;

} // namespace surflect
