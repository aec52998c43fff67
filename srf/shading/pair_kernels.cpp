#include "srf/shading/pair_kernels.h"

#include "srf/ulr/kriging.h"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "srf/shading/pair_kernels.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace surflect::shading {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, kPairLanes>;
using Lanes = hn::Vec<Tag>;
constexpr Tag kTag;
constexpr size_t kWidth = hn::MaxLanes(Tag());

HWY_INLINE Lanes load(const float* from) { return hn::LoadU(kTag, from); }
HWY_INLINE Lanes number(float x) { return hn::Set(kTag, x); }
HWY_INLINE Lanes infinity() { return number(__builtin_inff()); }

struct Vector {
  Lanes x, y, z;
};
HWY_INLINE Vector vectorOf(const float* v) { return {number(v[0]), number(v[1]), number(v[2])}; }
HWY_INLINE Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
// Without fused products, which not all instruction sets have.
HWY_INLINE Lanes dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
HWY_INLINE Lanes squared(const Vector& a) { return dot(a, a); }

// Half vectors are compared by
//   |h - g|^2 = |h|^2 + |g|^2 - 2 h . g,   h = (l + v) / m,   |l + v|^2 = 2 + 2 l . v
// so that what depends on the view or the light alone is computed once.
void writePairPenalties(const NearSources& viewers, const NearSources& lights, const RequestedPair& asked,
                        float* penalties) {
  const Vector light = vectorOf(asked.light), view = vectorOf(asked.view), half = vectorOf(asked.half);
  const Lanes halfSquared = squared(half), one = number(1), two = number(2);
  for (size_t lane = 0; lane < kPairLanes; lane += kWidth) {
    const Vector l{load(lights.x.data() + lane), load(lights.y.data() + lane), load(lights.z.data() + lane)};
    const Lanes lightAlongHalf = dot(l, half), ofThisLight = number(asked.ofLight) * squared(l - light);
    const Lanes apart =
        number(asked.ofShadow) * hn::Abs(load(lights.reached.data() + lane) - number(asked.shadow));
    const Lanes confidence = load(lights.confidence.data() + lane);
    for (size_t i = 0; i < viewers.size; ++i) {
      const Vector v{number(viewers.x[i]), number(viewers.y[i]), number(viewers.z[i])};
      const Lanes ofThisView = number(asked.ofView) * squared(v - view);
      const Lanes sum = hn::Max(number(0), two + two * dot(l, v));
      const Lanes inverse = one / hn::Max(hn::Sqrt(sum), number(ulr::kOppositeHalf));
      const Lanes halvesApart =
          sum * inverse * inverse + halfSquared - two * (lightAlongHalf + dot(v, half)) * inverse;
      const Lanes distance =
          number(asked.ofHalf) * hn::Max(number(0), halvesApart) + ofThisLight + ofThisView;
      const Lanes penalty =
          asked.isKriging ? hn::Sqrt(distance) * (one + apart) : number(0.5f) * (distance + apart * apart);
      const Lanes trust = confidence * number(viewers.confidence[i]);
      hn::StoreU(hn::IfThenElse(number(0) < trust, penalty / trust, infinity()), kTag,
                 penalties + kPairLanes * i + lane);
    }
  }
}

size_t findLeast(float* penalties, size_t count, size_t most, uint32_t* places, float* least) {
  constexpr float kLargest = std::numeric_limits<float>::max(); // Highway's emulated MinOfLanes of infinities
  for (size_t found = 0; found < most; ++found) {
    Lanes smallest = infinity(); // in each lane; the comparison leaves out NaN
    for (size_t i = 0; i < count; i += kWidth) {
      const Lanes penalty = load(penalties + i);
      smallest = hn::IfThenElse(penalty < smallest, penalty, smallest);
    }
    const Lanes all = hn::MinOfLanes(kTag, smallest);
    least[found] = hn::GetLane(all);
    if (!(least[found] < kLargest)) return found;
    for (size_t i = 0;; i += kWidth)
      if (const intptr_t lane = hn::FindFirstTrue(kTag, load(penalties + i) == all); lane >= 0) {
        places[found] = static_cast<uint32_t>(i + static_cast<size_t>(lane));
        break;
      }
    penalties[places[found]] = __builtin_inff();
  }
  return most;
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace surflect::shading
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::shading {

HWY_EXPORT(writePairPenalties);
void writePairPenalties(const NearSources& viewers, const NearSources& lights, const RequestedPair& asked,
                        float* penalties) {
  HWY_DYNAMIC_DISPATCH(writePairPenalties)(viewers, lights, asked, penalties);
}

HWY_EXPORT(findLeast);
size_t findLeast(float* penalties, size_t count, size_t most, uint32_t* places, float* least) {
  return HWY_DYNAMIC_DISPATCH(findLeast)(penalties, count, most, places, least);
}

} // namespace surflect::shading
#endif
