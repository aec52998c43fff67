#include "render/surfels/query_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/surfels/query_kernel.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include "surfel/math/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace surflect::surfels {
namespace HWY_NAMESPACE {

using namespace surflect::HWY_NAMESPACE; // vectors-inl.h
namespace {

struct SurfelLanes {
  Vector p, u, v, r0;
  Doubles s; // -1 under a mirroring warp, else 1
};
HWY_INLINE void copyTriple(float* to, const float* from) { __builtin_memcpy(to, from, 3 * sizeof *from); }
// Lanes from `count` on repeat the first.
HWY_INLINE SurfelLanes gather(const QueryJob& job, size_t begin, int count) {
  float p[3 * kDoubleLanes], u[3 * kDoubleLanes], v[3 * kDoubleLanes], r0[3 * kDoubleLanes];
  double s[kDoubleLanes];
  for (int i = 0; i < kDoubleLanes; ++i) {
    const size_t surfel = job.surfels[begin + static_cast<size_t>(i < count ? i : 0)];
    copyTriple(p + 3 * i, job.p + 3 * surfel);
    copyTriple(u + 3 * i, job.u + 3 * surfel);
    copyTriple(v + 3 * i, job.v + 3 * surfel);
    copyTriple(r0 + 3 * i, job.r0 + 3 * surfel);
    s[i] = job.handedness[surfel];
  }
  return {loadTriples(p), loadTriples(u), loadTriples(v), loadTriples(r0), hn::LoadU(kDoubles, s)};
}

// L = R0 (u-bar, v-bar, s n-bar)^T  [Weyrich 2005, Eq. 10], with the frame of polarFrame (frame.h), in double
// precision: its inputs are floats, so that nothing overflows or underflows.
HWY_INLINE Matrix lookUpOf(const SurfelLanes& surfel) {
  const Vector &u = surfel.u, &v = surfel.v;
  const Doubles uu = dot(u, u), uv = dot(u, v), vv = dot(v, v);
  const Vector normal = cross(u, v);
  const Doubles delta = Sqrt(dot(normal, normal));
  const Doubles scale = 1 / (Sqrt(uu + vv + (delta + delta)) * delta);
  const Vector ub = scale * ((vv + delta) * u - uv * v), vb = scale * ((uu + delta) * v - uv * u),
               nb = (surfel.s / delta) * normal;
  const RestFrame rest = restFrame(surfel.r0);
  const Vector n0 = cross(rest.u, rest.v);
  const auto column = [&](Doubles a, Doubles b, Doubles c)
                          HWY_ATTR { return mulAdd(a, rest.u, mulAdd(b, rest.v, c * n0)); };
  return {column(ub.x, vb.x, nb.x), column(ub.y, vb.y, nb.y), column(ub.z, vb.z, nb.z)};
}

// Writes the first `count` triples, each `stride` numbers after the one before.
HWY_INLINE void scatter(float* to, size_t stride, int count, const Vector& triples) {
  float packed[3 * kDoubleLanes];
  storeTriples(packed, triples);
  for (int i = 0; i < count; ++i) copyTriple(to + static_cast<size_t>(i) * stride, packed + 3 * i);
}

// Writes the directions to a source, and its irradiance, for the `count` queries from `begin` on, one per
// lane.
HWY_INLINE void direct(const QuerySource& source, const Vector& p, const Matrix& lookUp, size_t begin,
                       int count) {
  const Vector place = vectorOf(source.place);
  const double strength[3]{source.strength[0], source.strength[1], source.strength[2]};
  float* const towards = source.towards + begin * source.stride;
  float* const irradiance = source.irradiance ? source.irradiance + begin * source.stride : nullptr;
  if (source.isDistant) {
    scatter(towards, source.stride, count, lookUp * place);
    if (irradiance) scatter(irradiance, source.stride, count, vectorOf(strength));
    return;
  }
  const Vector d = place - p;
  const Doubles squared = dot(d, d), inverse = 1 / squared;
  scatter(towards, source.stride, count, Sqrt(inverse) * (lookUp * d));
  // A(|p* - p_l|) = 1 / d^2
  if (irradiance)
    scatter(irradiance, source.stride, count, hn::PromoteTo(kDoubles, rounded(inverse)) * vectorOf(strength));
  const hn::Mask<DoubleTag> apartMask = number(0) < squared;
  if (hn::AllTrue(kDoubles, apartMask)) return;
  const uint32_t apart = bitsOf(apartMask);
  float upwards[3 * kDoubleLanes]; // any direction will do if the source is at the surfel's place
  storeTriples(upwards, lookUp.z);
  for (int i = 0; i < count; ++i) {
    if (apart >> i & 1) continue;
    const float none[3]{};
    copyTriple(towards + static_cast<size_t>(i) * source.stride, upwards + 3 * i);
    if (irradiance) copyTriple(irradiance + static_cast<size_t>(i) * source.stride, none);
  }
}

void fillQueries(const QueryJob& job, size_t begin, size_t end) {
  for (size_t query = begin; query < end; query += kDoubleLanes) {
    const int count = end - query < kDoubleLanes ? static_cast<int>(end - query) : kDoubleLanes;
    const SurfelLanes surfels = gather(job, query, count);
    const Matrix lookUp = lookUpOf(surfels);
    for (size_t i = 0; i < job.sourceCount; ++i) direct(job.sources[i], surfels.p, lookUp, query, count);
  }
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::surfels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::surfels {

HWY_EXPORT(fillQueries);
void fillQueries(const QueryJob& job, size_t begin, size_t end) {
  HWY_DYNAMIC_DISPATCH(fillQueries)(job, begin, end);
}

} // namespace surflect::surfels
#endif
