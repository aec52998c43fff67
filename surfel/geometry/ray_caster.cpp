#include "surfel/geometry/ray_caster.h"

#include "surfel/base/error.h"
#include "surfel/geometry/embree.h"
#include "surfel/math/bounds.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <string>

namespace surflect {

namespace {

// An Embree scene of one geometry, around the middle of its points.
template <class Space> class EmbreeScene {
public:
  // An empty scene for points within a box. Low quality is built in a fraction of the time, for slower rays.
  explicit EmbreeScene(const Eigen::AlignedBox3d& box, RTCBuildQuality quality = RTC_BUILD_QUALITY_MEDIUM)
      : center_(box.center()), extent_(box.sizes().maxCoeff()), device_(rtcNewDevice(nullptr)) {
    requireSuccess({});
    scene_ = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene_, quality);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST | kFiltersInQueries);
  }
  ~EmbreeScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  // Adds the geometry, which the scene owns.
  RTCGeometry add(RTCGeometryType type) {
    const RTCGeometry geometry = rtcNewGeometry(device_, type);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry); // the scene's now
    return geometry;
  }

  // A new buffer of the geometry. Throws Error where it does not fit into memory.
  template <class T>
  T* buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, size_t size, size_t count) {
    void* values = rtcSetNewGeometryBuffer(geometry, type, 0, format, size, count);
    requireSuccess({});
    return static_cast<T*>(values);
  }

  // A point relative to the middle.
  template <class T> Vec3<float> recentred(const Point3<Space, T>& p) const {
    return (p.template cast<double>().raw() - center_).template cast<float>();
  }

  // Builds the hierarchy. Throws Cancelled.
  void commit(RTCGeometry geometry, const Progress& progress) {
    rtcCommitGeometry(geometry);
    rtcSetSceneProgressMonitorFunction(scene_, goesOn, const_cast<Progress*>(&progress));
    rtcCommitScene(scene_);
    rtcSetSceneProgressMonitorFunction(scene_, nullptr, nullptr);
    requireSuccess(progress);
  }

  // Empty where float arithmetic, which squares what it gets, cannot follow; such a ray meets nothing.
  std::optional<RTCRay> ray(const Point3<Space, double>& origin,
                            const Direction3<Space, double>& direction) const {
    constexpr double farthest = 1e18;
    const Vec3<double> fromCenter = origin.raw() - center_;
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

  // Is anything in the way, between `offset` and `distance`?
  bool occluded(const Point3<Space, double>& origin, const Direction3<Space, double>& direction,
                double offset, double distance) const {
    std::optional<RTCRay> blocked = ray(origin, direction);
    if (!blocked) return false;
    blocked->tnear = static_cast<float>(offset);
    blocked->tfar = static_cast<float>(distance);
    occludeRay(scene_, *blocked);
    return blocked->tfar < 0; // Embree's sign of a hit
  }

  RTCScene scene() const { return scene_; }
  double extent() const { return extent_; }

private:
  // Throws Error if Embree's last call failed, and Cancelled if the progress stopped it.
  void requireSuccess(const Progress& progress) const {
    const RTCError error = rtcGetDeviceError(device_);
    if (error == RTC_ERROR_CANCELLED) progress.checkpoint();
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw Error("the geometry does not fit into memory");
    if (error != RTC_ERROR_NONE) throw Error("Embree fails (error " + std::to_string(error) + ")");
  }
  static bool goesOn(void* progress, double) {
    const auto& cancelled = static_cast<const Progress*>(progress)->cancelled;
    return !cancelled || !cancelled();
  }

  Vec3<double> center_;
  double extent_;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

} // namespace

template <class Space> struct RayCaster<Space>::Scene : EmbreeScene<Space> {
  using EmbreeScene<Space>::EmbreeScene;
};

namespace {

struct WindingContext {
  EmbreeContext embree; // first, for Embree hands on a pointer to it
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

} // namespace

template <class Space> RayCaster<Space>::RayCaster(const Mesh<Space>& mesh, const Progress& progress) {
  auto scene = std::make_unique<Scene>(boundsOf(mesh.positions));
  const RTCGeometry geometry = scene->add(RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = scene->template buffer<float>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3,
                                                 3 * sizeof(float), mesh.positions.size());
  for (const auto& p : mesh.positions) vertices = std::copy_n(scene->recentred(p).data(), 3, vertices);
  auto* indices = scene->template buffer<uint32_t>(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3,
                                                   3 * sizeof(uint32_t), mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) indices = std::ranges::copy(triangle, indices).out;
  scene->commit(geometry, progress);
  scene_ = std::move(scene);
}

template <class Space> RayCaster<Space>::~RayCaster() = default;

template <class Space>
auto RayCaster<Space>::firstHit(const Point3<Space, double>& origin,
                                const Direction3<Space, double>& direction) const -> std::optional<Hit> {
  const std::optional<RTCRay> ray = scene_->ray(origin, direction);
  if (!ray) return std::nullopt;
  RTCRayHit query{*ray, {}};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  intersectRay(scene_->scene(), query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v};
}

template <class Space>
bool RayCaster<Space>::occluded(const Point3<Space, double>& origin,
                                const Direction3<Space, double>& direction, double offset,
                                double distance) const {
  return scene_->occluded(origin, direction, offset, distance);
}

template <class Space>
int RayCaster<Space>::winding(const Point3<Space, double>& origin,
                              const Direction3<Space, double>& direction) const {
  WindingContext context;
  std::optional<RTCRay> ray = scene_->ray(origin, direction);
  if (!ray) return 0;
  occludeRay(scene_->scene(), *ray, countCrossing, context.embree);
  return context.winding;
}

template <class Space> double RayCaster<Space>::selfHitOffset() const { return 1e-5 * scene_->extent(); }

template <class Space> struct DiscCaster<Space>::Scene : EmbreeScene<Space> {
  using EmbreeScene<Space>::EmbreeScene;
};

template <class Space>
DiscCaster<Space>::DiscCaster(const std::vector<Point3<Space>>& centers,
                              const std::vector<Normal3<Space>>& normals, const std::vector<float>& radii,
                              const Progress& progress) {
  assert(normals.size() == centers.size() && radii.size() == centers.size());
  auto scene = std::make_unique<Scene>(boundsOf(centers), RTC_BUILD_QUALITY_LOW);
  const RTCGeometry geometry = scene->add(RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
  auto* discs = scene->template buffer<float>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4,
                                              4 * sizeof(float), centers.size());
  auto* facing = scene->template buffer<float>(geometry, RTC_BUFFER_TYPE_NORMAL, RTC_FORMAT_FLOAT3,
                                               3 * sizeof(float), centers.size());
  for (size_t i = 0; i < centers.size(); ++i) {
    discs = std::copy_n(scene->recentred(centers[i]).data(), 3, discs);
    *discs++ = radii[i];
    facing = std::copy_n(normals[i].raw().data(), 3, facing);
  }
  scene->commit(geometry, progress);
  scene_ = std::move(scene);
}

template <class Space> DiscCaster<Space>::~DiscCaster() = default;
template <class Space> DiscCaster<Space>::DiscCaster(DiscCaster&&) noexcept = default;
template <class Space> DiscCaster<Space>& DiscCaster<Space>::operator=(DiscCaster&&) noexcept = default;

template <class Space>
bool DiscCaster<Space>::occluded(const Point3<Space, double>& origin,
                                 const Direction3<Space, double>& direction, double offset,
                                 double distance) const {
  return scene_->occluded(origin, direction, offset, distance);
}

template class RayCaster<AcquisitionSpace>;
template class RayCaster<ObjectSpace>;
template class DiscCaster<AcquisitionSpace>;
template class DiscCaster<ObjectSpace>;

} // namespace surflect
