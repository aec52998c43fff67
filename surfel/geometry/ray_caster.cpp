#include "surfel/geometry/ray_caster.h"

#include "surfel/geometry/embree_scene.h"

#include <algorithm>
#include <cassert>

namespace surflect {

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

template class RayCaster<AcquisitionSpace>;
template class RayCaster<ObjectSpace>;

} // namespace surflect
