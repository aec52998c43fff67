// The loops of look_up_kernel.h. A chunk is some terms of a job, as many as a vector has numbers: first those
// of the widest vector, then what is left in fours. Sums run over lights, over taps, over the terms of a
// chunk, and over chunks.
#pragma once

#include "srf/store/look_up_kernel.h"

#include <cstdint>

namespace surflect {
namespace {

typedef float Four __attribute__((vector_size(16)));
typedef float Eight __attribute__((vector_size(32)));
typedef int32_t FourWhole __attribute__((vector_size(16)));
typedef int8_t Bytes __attribute__((vector_size(16)));

constexpr size_t kChunksAtOnce = 4; // three sums each, which have to stay in registers

template <class Vector> inline Vector loaded(const float* from) {
  Vector v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}

template <class Vector> inline Vector broadcast(float x) { return x - Vector{}; }

// What the instructions may do better.
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
  float* rgb;
};

// c_k = sum_l w_l a_lk of `count` chunks, for red, green and blue.
template <class Vector, size_t count>
inline void fold(const LightWeight* row, size_t lights, const Chunk* chunks, Vector (*folded)[3]) {
  Vector sums[count][3] = {};
  const float* coefficients[count];
  size_t strides[count];
  for (size_t i = 0; i < count; ++i) {
    coefficients[i] = chunks[i].job->coefficients + chunks[i].first;
    strides[i] = chunks[i].job->stride;
  }
  for (size_t l = 0; l < lights; ++l) {
    const LightWeight& light = row[l];
    const auto red = broadcast<Vector>(light.weight.r), green = broadcast<Vector>(light.weight.g),
               blue = broadcast<Vector>(light.weight.b);
#pragma GCC unroll 4
    for (size_t i = 0; i < count; ++i) {
      const auto a = loaded<Vector>(coefficients[i] + light.light * strides[i]);
      sums[i][0] = mulAdd(red, a, sums[i][0]);
      sums[i][1] = mulAdd(green, a, sums[i][1]);
      sums[i][2] = mulAdd(blue, a, sums[i][2]);
    }
  }
  __builtin_memcpy(folded, sums, sizeof sums);
}

template <class Vector> inline void addTaps(const Chunk& chunk, const Vector* folded) {
  const LookUpJob& job = *chunk.job;
  const BlockTaps& taps = *job.taps;
  Vector e[3] = {};
#pragma GCC unroll 4
  for (size_t t = 0; t < 4; ++t) {
    const auto weight = broadcast<Vector>(taps.weights[t]);
    const int8_t* texel = job.levels + 3 * taps.texels[t] * job.stride + chunk.first;
    for (size_t channel = 0; channel < 3; ++channel)
      e[channel] = mulAdd(weight, levels<Vector>(texel + channel * job.stride), e[channel]);
  }
  Four sums[3];
  for (size_t channel = 0; channel < 3; ++channel) sums[channel] = inFour(folded[channel] * e[channel]);
  for (size_t channel = 0; channel < 3; ++channel)
    chunk.rgb[channel] += (sums[channel][0] + sums[channel][1]) + (sums[channel][2] + sums[channel][3]);
}

template <class Vector, size_t count>
inline void answerChunks(const LightWeight* row, size_t lights, const Chunk* chunks) {
  Vector folded[count][3];
  fold<Vector, count>(row, lights, chunks, folded);
  for (size_t i = 0; i < count; ++i) addTaps(chunks[i], folded[i]);
}

// Collects chunks and answers them, as many at a time as there are registers for.
template <class Vector> class Chunks {
public:
  Chunks(const LightWeight* row, size_t lights) : row_(row), lights_(lights) {}

  void add(const LookUpJob& job, size_t first, float* rgb) {
    chunks_[count_++] = {&job, first, rgb};
    if (count_ == kChunksAtOnce) answer();
  }
  void answer() {
    if (count_ == 1) answerChunks<Vector, 1>(row_, lights_, chunks_);
    if (count_ == 2) answerChunks<Vector, 2>(row_, lights_, chunks_);
    if (count_ == 3) answerChunks<Vector, 3>(row_, lights_, chunks_);
    if (count_ == 4) answerChunks<Vector, 4>(row_, lights_, chunks_);
    count_ = 0;
  }

private:
  const LightWeight* row_;
  size_t lights_;
  Chunk chunks_[kChunksAtOnce];
  size_t count_ = 0;
};

template <class Widest>
void lookUp(const LightWeight* row, size_t lights, const LookUpJob* jobs, size_t count, float* rgb) {
  constexpr size_t kWidth = sizeof(Widest) / sizeof(float);
  for (size_t i = 0; i < 3 * count; ++i) rgb[i] = 0;
  Chunks<Widest> wide(row, lights);
  for (size_t j = 0; j < count; ++j)
    for (size_t k = 0; k + kWidth <= jobs[j].stride; k += kWidth) wide.add(jobs[j], k, rgb + 3 * j);
  wide.answer();
  if (kWidth == 4) return;
  Chunks<Four> rest(row, lights); // after all wide ones: in the same order for each job
  for (size_t j = 0; j < count; ++j)
    if (jobs[j].stride % kWidth != 0) rest.add(jobs[j], jobs[j].stride - 4, rgb + 3 * j);
  rest.answer();
}

} // namespace
} // namespace surflect
