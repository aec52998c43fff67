// The few of many cameras or lights among which the nearest k + 1 to a direction are for sure, found in
// single precision and vector lanes. Who rates these few as ever (ulr.h) blends the same as after rating all,
// to the last bit.
#pragma once

#include "surfel/simd.h"
#include "surfel/space.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

// What a direction leads to: a place, or something so distant that the direction to it is everywhere the
// same, unit length.
struct Source {
  Vec3<double> place;
  bool isDistant = false;
};

class CandidateSieve {
public:
  // `middle` of the places that will be looked from.
  CandidateSieve(std::span<const Source> sources, const Vec3<double>& middle, Simd simd);

  // From where the next directions are.
  void lookFrom(const Vec3<double>& place);

  // Every source whose penalty of anglePenalty (unit directions of single precision) over fade is not beyond
  // those of `wanted` others, ascending, and few more. fades: a byte per source as ViewFades has them, whose
  // size they matter by, or only in being 0 (`byFade` false); none: all are seen. Sources with a fade of 0
  // are left out. wanted: 1..kMaxBlended + 1. Valid until the next call.
  std::span<const uint32_t> nearest(const Direction3<AcquisitionSpace>& towards, size_t wanted,
                                    std::span<const uint8_t> fades = {}, bool byFade = true);

private:
  size_t count_;
  Simd simd_;
  Vec3<double> middle_;
  double scale_ = 1; // to units in which the farthest source is about 1 from the middle
  bool allDistant_ = true, isSafe_ = false;
  std::vector<float> x_, y_, z_, isNear_, fromMiddle_; // of the sources
  std::vector<float> towardsX_, towardsY_, towardsZ_;  // to them
  std::vector<uint8_t> fades_, allSeen_;
  std::vector<float> bounds_;
  std::vector<uint32_t> found_;
};

} // namespace surflect
