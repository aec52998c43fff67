// Why no source is missed. With u = 2^-24:
//   A source's place and the own are rounded to single precision relative to the middle, and subtracted: the
//   difference is off by u (c + p + d), with c and p how far both are from the middle, d how far from each
//   other. lookFrom trusts it for (c + p) / d <= 64, so its direction is off by 65 u; by 12 u more through
//   Newton's step from an estimate within 2^-11, and roundings. The direction that the penalty is defined by
//   is itself rounded, by u. Two penalties |a - b|^2 / 2 of unit vectors differ by at most twice what the
//   vectors do, and are rounded by 6 u of at most 2 each. In all 2 x 78 u + 24 u < 1.1e-5.
//   Directions to what is distant are those of the penalty, and only the rounding is left.
//   So penalty - slack and penalty + slack, over the fade, hold the true one between them, but for the
//   rounding of 1 / fade and products, below 1e-6, to which the kernel's factor of 1 + 4e-6 gives way. The
//   limit is an upper bound of `wanted` sources; who is above it with its lower bound is beyond them all.
#include "srf/query/candidate_sieve.h"

#include "srf/query/sieve_kernels.h"
#include "srf/query/ulr.h"
#include "srf/query/view_fade.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numeric>

namespace surflect {

namespace {

constexpr float kSlackNear = 1.2e-5f, kSlackDistant = 2e-6f;

// 1 / fade of the byte 16 h + l is coarse[h] fine[l].
struct InverseFades {
  std::array<float, 16> coarse, fine;
};
const InverseFades& inverseFades(bool byFade) {
  static const InverseFades ones = [] {
    InverseFades all;
    all.coarse.fill(1), all.fine.fill(1);
    return all;
  }();
  static const InverseFades inverse = [] { // a fade is exponential in its byte, and that of 255 is 1
    InverseFades all;
    const double ofSixteen = ViewFades::decode(255) / double{ViewFades::decode(240)};
    for (int i = 0; i < 16; ++i) {
      all.coarse[i] = static_cast<float>(ofSixteen / ViewFades::decode(static_cast<uint8_t>(16 * i + 15)));
      all.fine[i] = static_cast<float>(double{ViewFades::decode(240)} /
                                       ViewFades::decode(static_cast<uint8_t>(240 + i)));
    }
    return all;
  }();
  return byFade ? inverse : ones;
}

} // namespace

CandidateSieve::CandidateSieve(std::span<const Source> sources, const Vec3<double>& middle, Simd simd)
    : count_(sources.size()), simd_(simd), middle_(middle) {
  double farthest = 0;
  for (const Source& source : sources)
    if (!source.isDistant) farthest = std::max(farthest, (source.place - middle).norm());
  if (std::isnormal(farthest)) scale_ = std::exp2(-std::ilogb(farthest));

  const size_t padded = (count_ + kSieveLanes - 1) / kSieveLanes * kSieveLanes;
  for (auto* values : {&x_, &y_, &z_, &isNear_, &fromMiddle_, &bounds_}) values->resize(padded);
  std::ranges::fill(x_, 1.f); // what fills the last group is distant, and not seen
  found_.resize(padded);
  fades_.resize(padded);
  allSeen_.resize(padded);
  std::fill_n(allSeen_.begin(), count_, uint8_t{255});
  for (size_t i = 0; i < count_; ++i) {
    const auto& [place, isDistant] = sources[i];
    const Vec3<double> at = isDistant ? place : Vec3<double>(scale_ * (place - middle));
    x_[i] = static_cast<float>(at[0]);
    y_[i] = static_cast<float>(at[1]);
    z_[i] = static_cast<float>(at[2]);
    if (isDistant) continue;
    allDistant_ = false;
    isNear_[i] = 1;
    fromMiddle_[i] = static_cast<float>(at.norm());
  }
  isSafe_ = allDistant_;
  towardsX_ = x_;
  towardsY_ = y_;
  towardsZ_ = z_;
}

void CandidateSieve::lookFrom(const Vec3<double>& place) {
  if (allDistant_) return;
  const Vec3<double> at = scale_ * (place - middle_);
  const Vec3<float> rounded = at.cast<float>();
  isSafe_ = sieveKernels(simd_).lookFrom(
      {x_.data(), y_.data(), z_.data(), isNear_.data(), fromMiddle_.data(), x_.size() / kSieveLanes},
      rounded.data(), static_cast<float>(at.norm()), {towardsX_.data(), towardsY_.data(), towardsZ_.data()});
}

std::span<const uint32_t> CandidateSieve::nearest(const Direction3<AcquisitionSpace>& towards, size_t wanted,
                                                  std::span<const uint8_t> fades, bool byFade) {
  assert(wanted >= 1 && wanted <= kMaxBlended + 1);
  assert(fades.empty() || fades.size() == count_);
  if (!fades.empty()) std::ranges::copy(fades, fades_.begin());
  const std::vector<uint8_t>& seen = fades.empty() ? allSeen_ : fades_;
  if (!isSafe_) {
    size_t count = 0;
    for (uint32_t i = 0; i < count_; ++i)
      if (seen[i] > 0) found_[count++] = i;
    return {found_.data(), count};
  }
  const auto& [coarse, fine] = inverseFades(byFade && !fades.empty());
  const Vec3<float>& q = towards.raw();
  const size_t count = sieveKernels(simd_).nearest(
      {towardsX_.data(), towardsY_.data(), towardsZ_.data()}, x_.size() / kSieveLanes,
      {q[0], q[1], q[2], allDistant_ ? kSlackDistant : kSlackNear, seen.data(), coarse.data(), fine.data(),
       wanted},
      bounds_.data(), found_.data());
  return {found_.data(), count};
}

} // namespace surflect
