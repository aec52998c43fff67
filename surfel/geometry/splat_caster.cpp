#include "surfel/geometry/splat_caster.h"

#include "surfel/geometry/embree_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace surflect {

namespace {

// Sum of 1/4, as an integer: sums then do not depend on the order of splats.
constexpr uint32_t kQuarter = 1 << 20;

// A splat as the filter needs it: x = center + a u + b v has a = alongU . (x - center), b likewise.
struct SplatKernel {
  Vec3<float> center, alongU, alongV; // recentred
  float coverage;
};

struct BlockingContext {
  EmbreeContext embree; // first, for Embree hands on a pointer to it
  const SplatKernel* splats;
  Vec3<float> origin, direction;
  uint32_t sum = 0;
};

// Adds the splat that the ray meets, and lets the ray pass unless the sum is enough.
void addSplat(const RTCFilterFunctionNArguments* met) {
  const RTCRay ray = rtcGetRayFromRayN(met->ray, met->N, 0);
  const RTCHit hit = rtcGetHitFromHitN(met->hit, met->N, 0);
  auto& context = *reinterpret_cast<BlockingContext*>(met->context);
  const SplatKernel& splat = context.splats[hit.primID];
  const Vec3<float> x = context.origin + ray.tfar * context.direction - splat.center;
  const float a = splat.alongU.dot(x), b = splat.alongV.dot(x), rest = std::max(0.f, 1 - a * a - b * b);
  const float covered = std::min(1.f, splat.coverage * rest * rest);
  context.sum += static_cast<uint32_t>(4 * covered * static_cast<float>(kQuarter));
  if (context.sum < kQuarter + kQuarter / 2) met->valid[0] = 0;
}

} // namespace

template <class Space> struct SplatCaster<Space>::Scene : EmbreeScene<Space> {
  using EmbreeScene<Space>::EmbreeScene;
  std::vector<SplatKernel> splats;
};

template <class Space>
SplatCaster<Space>::SplatCaster(const std::vector<OpaqueSplat<Space>>& splats, const Progress& progress) {
  std::vector<Point3<Space>> centers;
  for (const auto& splat : splats) centers.push_back(splat.center);
  auto scene = std::make_unique<Scene>(boundsOf(centers), RTC_BUILD_QUALITY_LOW);
  const RTCGeometry geometry = scene->add(RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
  auto* discs = scene->template buffer<float>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4,
                                              4 * sizeof(float), splats.size());
  auto* facing = scene->template buffer<float>(geometry, RTC_BUFFER_TYPE_NORMAL, RTC_FORMAT_FLOAT3,
                                               3 * sizeof(float), splats.size());
  for (const auto& [center, u, v, coverage] : splats) {
    const Vec3<float> c = scene->recentred(center), n = u.raw().cross(v.raw());
    const float squared = n.squaredNorm();
    scene->splats.push_back({c, v.raw().cross(n) / squared, n.cross(u.raw()) / squared, coverage});
    discs = std::copy_n(c.data(), 3, discs);
    *discs++ = longerAxis(u.raw(), v.raw());
    facing = std::copy_n(Vec3<float>(n / std::sqrt(squared)).data(), 3, facing);
  }
  scene->commit(geometry, progress);
  scene_ = std::move(scene);
}

template <class Space> SplatCaster<Space>::~SplatCaster() = default;
template <class Space> SplatCaster<Space>::SplatCaster(SplatCaster&&) noexcept = default;
template <class Space> SplatCaster<Space>& SplatCaster<Space>::operator=(SplatCaster&&) noexcept = default;

template <class Space>
float SplatCaster<Space>::blocked(const Point3<Space, double>& origin,
                                  const Direction3<Space, double>& direction, double offset,
                                  double distance) const {
  std::optional<RTCRay> ray = scene_->ray(origin, direction);
  if (!ray) return 0;
  ray->tnear = static_cast<float>(offset);
  ray->tfar = static_cast<float>(distance);
  BlockingContext context{
      {}, scene_->splats.data(), {ray->org_x, ray->org_y, ray->org_z}, {ray->dir_x, ray->dir_y, ray->dir_z}};
  occludeRay(scene_->scene(), *ray, addSplat, context.embree);
  return std::clamp(static_cast<float>(context.sum) / kQuarter - 0.5f, 0.f, 1.f);
}

template class SplatCaster<AcquisitionSpace>;
template class SplatCaster<ObjectSpace>;

} // namespace surflect
