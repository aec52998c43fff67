// Scenes of Embree around the middle of their geometry.
#pragma once

#include "surfel/base/error.h"
#include "surfel/base/time.h"
#include "surfel/geometry/embree.h"
#include "surfel/math/bounds.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>

namespace surflect {

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

} // namespace surflect
