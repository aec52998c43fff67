// The loops of look_up_kernel.h. Terms are taken kWidth at a time, or four; whichever it is, every number is
// summed in the same order: over lights, over taps, and over terms in four lanes. Nothing is contracted.
#pragma once

#include "srf/store/look_up_kernel.h"

#include <cstdint>

namespace surflect {
namespace {

typedef float Four __attribute__((vector_size(16)));
typedef float Eight __attribute__((vector_size(32)));
typedef int32_t FourWhole __attribute__((vector_size(16)));
typedef int8_t Bytes __attribute__((vector_size(16)));

template <class Vector> inline Vector loaded(const float* from) {
  Vector v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}

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

inline Four addTo(Four sum, Four x) { return sum + x; }
inline Four addTo(Four sum, Eight x) {
  return (sum + __builtin_shufflevector(x, x, 0, 1, 2, 3)) + __builtin_shufflevector(x, x, 4, 5, 6, 7);
}

// The terms from k on, as many as the vector has: adds their part to the sums of the channels.
template <class Vector>
inline void addTerms(const LookUpJob& job, const BlockTaps& taps, size_t k, Four* sums) {
  Vector red{}, green{}, blue{}; // c_k = sum_l w_l a_lk
  for (size_t l = 0; l < job.lights; ++l) {
    const LightWeight& light = job.row[l];
    const auto a = loaded<Vector>(job.coefficients + light.light * job.stride + k);
    red += light.weight.r * a;
    green += light.weight.g * a;
    blue += light.weight.b * a;
  }
  const Vector folded[3] = {red, green, blue};
  for (size_t channel = 0; channel < 3; ++channel) {
    Vector e{};
    for (uint32_t t = 0; t < taps.count; ++t)
      e += taps.weights[t] * levels<Vector>(job.levels + (3 * taps.texels[t] + channel) * job.stride + k);
    sums[channel] = addTo(sums[channel], folded[channel] * e);
  }
}

template <class Widest> void lookUp(const LookUpJob& job, const BlockTaps& taps, float* rgb) {
  constexpr size_t kWidth = sizeof(Widest) / sizeof(float);
  Four sums[3] = {};
  size_t k = 0;
  for (; k + kWidth <= job.stride; k += kWidth) addTerms<Widest>(job, taps, k, sums);
  for (; k < job.stride; k += 4) addTerms<Four>(job, taps, k, sums);
  for (size_t channel = 0; channel < 3; ++channel)
    rgb[channel] = (sums[channel][0] + sums[channel][1]) + (sums[channel][2] + sums[channel][3]);
}

} // namespace
} // namespace surflect
