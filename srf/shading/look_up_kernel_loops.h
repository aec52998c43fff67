// The loops of look_up_kernel.h. A chunk is some terms of a job, as many as a vector has numbers. Sums run
// over the weights of a light, over lights, over taps, over the terms of a chunk, and over chunks.
#pragma once

#include "srf/shading/look_up_kernel.h"

#include <cstdint>

namespace surflect::shading {
namespace {

typedef float Four __attribute__((vector_size(16)));
typedef float Eight __attribute__((vector_size(32)));
typedef int32_t FourWhole __attribute__((vector_size(16)));
typedef int8_t Bytes __attribute__((vector_size(16)));

// Four sums each, which have to stay in registers.
#ifdef __AVX512VL__
constexpr size_t kChunksAtOnce = 6;
#else
constexpr size_t kChunksAtOnce = 3;
#endif

template <class Vector> inline Vector loaded(const float* from) {
  Vector v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}

template <class Vector> inline Vector broadcast(float x) { return x - Vector{}; }

// Replaced by a fused form where there is one.
template <class Vector> inline Vector mulAdd(Vector x, Vector y, Vector z) { return x * y + z; }

// As many levels as the vector has numbers; of eight, where they are used. Compilers would widen them one by
// one.
template <class Vector> inline Vector levels(const int8_t* from);
template <> inline Four levels(const int8_t* from) {
  Bytes bytes{};
  __builtin_memcpy(&bytes, from, 4);
  const Bytes lasts = __builtin_shufflevector(bytes, bytes, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
  const FourWhole whole = reinterpret_cast<FourWhole>(lasts) >> 24; // of each four bytes the last
  return __builtin_convertvector(whole, Four);
}

inline Four inFour(Four x) { return x; }
inline Four inFour(Eight x) {
  return __builtin_shufflevector(x, x, 0, 1, 2, 3) + __builtin_shufflevector(x, x, 4, 5, 6, 7);
}

struct Chunk {
  const LookUpJob* job;
  size_t first; // term
};

// The weights of captured lights.
struct Row {
  const BlendedLight* lights;
  size_t count;
  const LightWeight* weights;
};

// c_k = sum_i color_i sum_l w_il a_lk of `count` chunks, for red, green and blue. Where all of them have the
// same stride, a light is in the same place in each.
template <class Vector, size_t count, bool sameStride>
inline void fold(const Row& row, const Chunk* chunks, Vector (*folded)[3]) {
  Vector sums[count][3] = {};
  const float* coefficients[count];
  size_t strides[count];
  for (size_t i = 0; i < count; ++i) {
    coefficients[i] = chunks[i].job->coefficients + chunks[i].first;
    strides[i] = chunks[i].job->stride;
  }
  for (const BlendedLight* light = row.lights; light != row.lights + row.count; ++light) {
    Vector blended[count] = {};
    for (const LightWeight* of = row.weights + light->begin; of != row.weights + light->end; ++of) {
      const auto weight = broadcast<Vector>(of->weight);
      const size_t place = of->light * strides[0];
#pragma GCC unroll 8
      for (size_t i = 0; i < count; ++i)
        blended[i] =
            mulAdd(weight, loaded<Vector>(coefficients[i] + (sameStride ? place : of->light * strides[i])),
                   blended[i]);
    }
    const auto red = broadcast<Vector>(light->color.r), green = broadcast<Vector>(light->color.g),
               blue = broadcast<Vector>(light->color.b);
#pragma GCC unroll 8
    for (size_t i = 0; i < count; ++i) {
      sums[i][0] = mulAdd(red, blended[i], sums[i][0]);
      sums[i][1] = mulAdd(green, blended[i], sums[i][1]);
      sums[i][2] = mulAdd(blue, blended[i], sums[i][2]);
    }
  }
  __builtin_memcpy(folded, sums, sizeof sums);
}

// Sums of a chunk's products in red, green and blue; neighbours are added first.
template <class Vector> inline Vector sumsOf(Vector red, Vector green, Vector blue) {
  return Vector{(red[0] + red[1]) + (red[2] + red[3]), (green[0] + green[1]) + (green[2] + green[3]),
                (blue[0] + blue[1]) + (blue[2] + blue[3]), 0};
}

template <class Vector> inline void addTaps(const Chunk& chunk, const Vector* folded) {
  const LookUpJob& job = *chunk.job;
  const int8_t* texels = job.levels + chunk.first;
  const size_t stride = job.stride;
  Vector e[3] = {};
#pragma GCC unroll 4
  for (size_t t = 0; t < 4; ++t) {
    const auto weight = broadcast<Vector>(job.weights[t]);
    const int8_t* texel = texels + (t % 2 != 0 ? job.right : 0) + (t / 2 != 0 ? job.down : 0);
    for (size_t channel = 0; channel < 3; ++channel)
      e[channel] = mulAdd(weight, levels<Vector>(texel + channel * stride), e[channel]);
  }
  const Four sums = sumsOf(inFour(folded[0] * e[0]), inFour(folded[1] * e[1]), inFour(folded[2] * e[2]));
  const Four all = loaded<Four>(job.rgb) + sums;
  __builtin_memcpy(job.rgb, &all, sizeof all);
}

template <class Vector, size_t count> inline void answerChunks(const Row& row, const Chunk* chunks) {
  Vector folded[count][3];
  bool isSame = true;
  for (size_t i = 1; i < count; ++i) isSame &= chunks[i].job->stride == chunks[0].job->stride;
  if (isSame)
    fold<Vector, count, true>(row, chunks, folded);
  else
    fold<Vector, count, false>(row, chunks, folded);
  for (size_t i = 0; i < count; ++i) addTaps(chunks[i], folded[i]);
}

// Answers `count` chunks, 1..most.
template <class Vector, size_t most> inline void answer(const Row& row, const Chunk* chunks, size_t count) {
  if (count == most) return answerChunks<Vector, most>(row, chunks);
  if constexpr (most > 1) answer<Vector, most - 1>(row, chunks, count);
}

template <class Vector>
void lookUp(const BlendedLight* lights, size_t lightCount, const LightWeight* weights, const LookUpJob* jobs,
            size_t count) {
  constexpr size_t kWidth = sizeof(Vector) / sizeof(float);
  const Row row{lights, lightCount, weights};
  Chunk chunks[kChunksAtOnce]; // answered as many at a time as there are registers for
  size_t held = 0;
  for (const LookUpJob* job = jobs; job != jobs + count; ++job)
    for (size_t first = 0; first < job->stride; first += kWidth) {
      chunks[held++] = {job, first};
      if (held < kChunksAtOnce) continue;
      answerChunks<Vector, kChunksAtOnce>(row, chunks);
      held = 0;
    }
  if (held > 0) answer<Vector, kChunksAtOnce - 1>(row, chunks, held);
}

} // namespace
} // namespace surflect::shading
