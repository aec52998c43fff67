// The loops of query_kernels.h, in the lanes that the compiler was told to use.
#pragma once

#include "render/surfels/query_kernels.h"
#include "surfel/math/vector_lanes.h"

namespace surflect::surfels {
namespace {

constexpr int kQueryGroup = 8;

struct SurfelLanes {
  Vector p, u, v, r0;
  DoubleLanes s; // -1 under a mirroring warp, else 1
};
inline void copyTriple(float* to, const float* from) { __builtin_memcpy(to, from, 3 * sizeof *from); }
// Lanes from `count` on repeat the first.
inline SurfelLanes gather(const QueryJob& job, size_t begin, int count) {
  float p[3 * kQueryGroup], u[3 * kQueryGroup], v[3 * kQueryGroup], r0[3 * kQueryGroup];
  double s[kQueryGroup];
  for (int i = 0; i < kQueryGroup; ++i) {
    const size_t surfel = job.surfels[begin + static_cast<size_t>(i < count ? i : 0)];
    copyTriple(p + 3 * i, job.p + 3 * surfel);
    copyTriple(u + 3 * i, job.u + 3 * surfel);
    copyTriple(v + 3 * i, job.v + 3 * surfel);
    copyTriple(r0 + 3 * i, job.r0 + 3 * surfel);
    s[i] = job.handedness[surfel];
  }
  return {loadTriples(p), loadTriples(u), loadTriples(v), loadTriples(r0), load(s)};
}

// L = R0 (u-bar, v-bar, s n-bar)^T  [Weyrich 2005, Eq. 10], with the frame of polarFrame (frame.h), written
// for double precision of what was float: nothing over- or underflows.
inline Matrix lookUpOf(const SurfelLanes& surfel) {
  const Vector &u = surfel.u, &v = surfel.v;
  const DoubleLanes uu = dot(u, u), uv = dot(u, v), vv = dot(v, v);
  const Vector normal = cross(u, v);
  const DoubleLanes delta = sqrt(dot(normal, normal));
  const DoubleLanes scale = 1 / (sqrt(uu + vv + (delta + delta)) * delta);
  const Vector ub = scale * ((vv + delta) * u - uv * v), vb = scale * ((uu + delta) * v - uv * u),
               nb = (surfel.s / delta) * normal;
  const RestFrame rest = restFrame(surfel.r0);
  const Vector n0 = cross(rest.u, rest.v);
  const auto column = [&](DoubleLanes a, DoubleLanes b, DoubleLanes c) {
    return mulAdd(a, rest.u, mulAdd(b, rest.v, c * n0));
  };
  return {column(ub.x, vb.x, nb.x), column(ub.y, vb.y, nb.y), column(ub.z, vb.z, nb.z)};
}

// Writes the first `count` of eight triples, each `stride` numbers after the one before.
inline void scatter(float* to, size_t stride, int count, const Vector& triples) {
  float packed[3 * kQueryGroup];
  storeTriples(packed, triples);
  for (int i = 0; i < count; ++i) copyTriple(to + static_cast<size_t>(i) * stride, packed + 3 * i);
}

// What a source is to eight queries of which `count` are there, the first of them query `begin`.
inline void direct(const QuerySource& source, const Vector& p, const Matrix& lookUp, size_t begin,
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
  const DoubleLanes squared = dot(d, d), inverse = 1 / squared;
  scatter(towards, source.stride, count, sqrt(inverse) * (lookUp * d));
  // A(|p* - p_l|) = 1 / d^2
  if (irradiance) scatter(irradiance, source.stride, count, roundedToFloat(inverse) * vectorOf(strength));
  const uint32_t apart = bitsOfLess(0, squared);
  if (apart == 0xff) return;
  float upwards[3 * kQueryGroup]; // any direction will do where the source sits on the surfel
  storeTriples(upwards, lookUp.z);
  for (int i = 0; i < count; ++i) {
    if ((apart >> i & 1) != 0) continue;
    const float none[3]{};
    copyTriple(towards + static_cast<size_t>(i) * source.stride, upwards + 3 * i);
    if (irradiance) copyTriple(irradiance + static_cast<size_t>(i) * source.stride, none);
  }
}

void directAll(const QueryJob& job, size_t begin, size_t end) {
  for (size_t query = begin; query < end; query += kQueryGroup) {
    const int count = end - query < kQueryGroup ? static_cast<int>(end - query) : kQueryGroup;
    const SurfelLanes surfels = gather(job, query, count);
    const Matrix lookUp = lookUpOf(surfels);
    for (size_t i = 0; i < job.sourceCount; ++i) direct(job.sources[i], surfels.p, lookUp, query, count);
  }
}

constexpr QueryKernels kernelsOfTheseLanes{directAll};

} // namespace
} // namespace surflect::surfels
