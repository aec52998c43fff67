#include "srf/codec/block_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "srf/codec/block_kernels.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace surflect::codec {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Vectors of 64 bytes at most, and of eight numbers for the remainder of a row, which is padded to eight.
template <class Real> using Wide = hn::CappedTag<Real, 64 / sizeof(Real)>;
template <class Real> using Eight = hn::CappedTag<Real, 8>;
constexpr bool kManyRegisters = hn::MaxLanes(Wide<float>()) == 16;

// Rounding errors of the columns from j on, one in each lane of D.
template <class D, class Real> HWY_INLINE void roundingOf(D d, const Rounding<Real>& job, size_t j) {
  using V = hn::Vec<D>;
  const auto number = [d](Real x) HWY_ATTR { return hn::Set(d, x); };
  const auto stored = [&](size_t i) HWY_ATTR {
    return hn::LoadU(d, job.values + i * job.columns + j) * number(job.inverseWeights[i]);
  };
  V peak = hn::Zero(d);
  for (size_t i = 0; i < job.rows; ++i) peak = Max(peak, Abs(stored(i)));
  V steps[roundings], scales[roundings], sums[roundings];
  for (size_t r = 0; r < roundings; ++r) {
    steps[r] = peak * number(job.clip[r] / job.last[r]);
    scales[r] = number(1) / steps[r];
    sums[r] = hn::Zero(d);
  }
  for (size_t i = 0; i < job.rows; ++i) {
    const V x = stored(i), weight = number(job.weights[i]);
#pragma GCC unroll 9
    for (size_t r = 0; r < roundings; ++r) {
      const V last = number(job.last[r]);
      const V level = Round(Max(Min(x * scales[r], last), Neg(last)));
      const V error = (x - steps[r] * level) * weight;
      sums[r] = sums[r] + error * error;
    }
  }
  for (size_t r = 0; r < roundings; ++r) hn::StoreU(sums[r], d, job.squaredErrors + r * job.columns + j);
}

template <class Real> void roundingErrors(const Rounding<Real>& job) {
  constexpr size_t width = hn::MaxLanes(Wide<Real>()), narrow = hn::MaxLanes(Eight<Real>());
  size_t j = 0;
  for (; j + width <= job.columns; j += width) roundingOf(Wide<Real>(), job, j);
  for (; j < job.columns; j += narrow) roundingOf(Eight<Real>(), job, j);
}

// Adds the errors of `texels` texels, for the lights from j on, to those of earlier texels.
template <size_t texels, bool seen> HWY_INLINE void errorsOf(const BlockErrors& job, size_t first, size_t j) {
  constexpr size_t rows = 3 * texels;
  const Eight<double> d;
  using V = hn::Vec<Eight<double>>;
  V shown[rows], squares[3], clipped = hn::Zero(d);
#pragma GCC unroll 12
  for (V& x : shown) x = hn::Zero(d);
  const double *levels = job.levels + 3 * first * job.terms, *perLevel = job.perLevel + j;
  for (size_t k = 0; k < job.terms; ++k, levels += 3, perLevel += job.lights) {
    const V p = hn::LoadU(d, perLevel);
#pragma GCC unroll 12
    for (size_t i = 0; i < rows; ++i)
      shown[i] = shown[i] + hn::Set(d, levels[i / 3 * 3 * job.terms + i % 3]) * p;
  }
  const V white = hn::Set(d, job.white), black = hn::Zero(d);
#pragma GCC unroll 3
  for (size_t c = 0; c < 3; ++c)
    squares[c] = first > 0 ? hn::LoadU(d, job.squares + c * job.lights + j) : hn::Zero(d);
  if (seen && first > 0) clipped = hn::LoadU(d, job.clipped + j);
#pragma GCC unroll 12
  for (size_t i = 0; i < rows; ++i) {
    const hn::Rebind<float, Eight<double>> narrow;
    const V x = hn::PromoteTo(d, hn::LoadU(narrow, job.x + (3 * first + i) * job.lights + j));
    const V error = x - shown[i];
    squares[i % 3] = squares[i % 3] + error * error;
    if (!seen) continue;
    const V visible = Min(Max(x, black), white) - Min(Max(shown[i], black), white);
    clipped = clipped + visible * visible;
  }
#pragma GCC unroll 3
  for (size_t c = 0; c < 3; ++c) hn::StoreU(squares[c], d, job.squares + c * job.lights + j);
  if (seen) hn::StoreU(clipped, d, job.clipped + j);
}

template <bool seen> HWY_INLINE void errorsOf(const BlockErrors& job) {
  constexpr size_t width = hn::MaxLanes(Eight<double>());
  constexpr size_t kTexels = kManyRegisters ? 4 : 2;
  size_t texel = 0;
  for (; texel + kTexels <= job.texels; texel += kTexels)
    for (size_t j = 0; j < job.lights; j += width) errorsOf<kTexels, seen>(job, texel, j);
  for (; texel < job.texels; ++texel)
    for (size_t j = 0; j < job.lights; j += width) errorsOf<1, seen>(job, texel, j);
}

void blockErrors(const BlockErrors& job) {
  if (job.clipped)
    errorsOf<true>(job);
  else
    errorsOf<false>(job);
}

void roundingErrorsOfFloats(const Rounding<float>& job) { roundingErrors<float>(job); }
void roundingErrorsOfDoubles(const Rounding<double>& job) { roundingErrors<double>(job); }

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::codec
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::codec {

HWY_EXPORT(roundingErrorsOfFloats);
void roundingErrors(const Rounding<float>& job) { HWY_DYNAMIC_DISPATCH(roundingErrorsOfFloats)(job); }
HWY_EXPORT(roundingErrorsOfDoubles);
void roundingErrors(const Rounding<double>& job) { HWY_DYNAMIC_DISPATCH(roundingErrorsOfDoubles)(job); }

HWY_EXPORT(blockErrors);
void blockErrors(const BlockErrors& job) { HWY_DYNAMIC_DISPATCH(blockErrors)(job); }

} // namespace surflect::codec
#endif
