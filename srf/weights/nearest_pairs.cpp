#include "srf/weights/nearest_pairs.h"

#include "srf/weights/ulr.h"

#include <algorithm>
#include <limits>
#include <numeric>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "srf/weights/nearest_pairs.cpp"
#include <hwy/foreach_target.h>
// Must come after foreach_target, which compiles this file once for each instruction set.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace surflect::weights {
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
void writePairPenalties(const NearPairs& pairs, const RequestedPair& asked, float* penalties) {
  const NearSources &viewers = pairs.viewers, &lights = pairs.lights;
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
      const Lanes inverse = one / hn::Max(hn::Sqrt(sum), number(kOppositeHalf));
      const Lanes halvesApart =
          sum * inverse * inverse + halfSquared - two * (lightAlongHalf + dot(v, half)) * inverse;
      const Lanes distance =
          number(asked.ofHalf) * hn::Max(number(0), halvesApart) + ofThisLight + ofThisView;
      const Lanes penalty = hn::Sqrt(distance) * (one + apart);
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
} // namespace surflect::weights
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace surflect::weights {

CapturedPairs::CapturedPairs(const ReflectanceField& field)
    : lights_(field.rig.lights.size()), numbers_(field.rig.views.size() * lights_, kMissing) {
  for (uint32_t view = 0; view < field.columns.size(); ++view) {
    firstPair_.push_back(pairs_.size());
    for (uint32_t column = 0; column < field.columns[view].size(); ++column) {
      const uint32_t light = field.columns[view][column];
      numbers_[view * lights_ + light] = static_cast<uint32_t>(pairs_.size());
      pairs_.push_back({view, column, light});
    }
  }
}

bool hasNearPairs(const ReflectanceField& field) {
  if (field.isFullProduct) return true;
  std::vector<Direction3<AcquisitionSpace>> towardsViews, towardsLights;
  for (const capture::View& view : field.rig.views)
    towardsViews.push_back(capture::Viewpoint(view.camera).towards(field.middle).cast<float>());
  for (const capture::Light& light : field.rig.lights)
    towardsLights.push_back(capture::towardsLight(light, field.middle).cast<float>());
  // For each direction, the indices of the kNearSources nearest, itself among them.
  const auto neighbourhoods = [](std::span<const Direction3<AcquisitionSpace>> towards) {
    std::vector<std::vector<uint32_t>> all;
    for (const auto& centre : towards) {
      std::vector<uint32_t> nearest(towards.size());
      std::iota(nearest.begin(), nearest.end(), 0u);
      const auto count = static_cast<std::ptrdiff_t>(std::min(kNearSources, nearest.size()));
      std::ranges::partial_sort(nearest, nearest.begin() + count, {},
                                [&](uint32_t i) { return anglePenalty(towards[i], centre); });
      nearest.resize(static_cast<size_t>(count));
      all.push_back(std::move(nearest));
    }
    return all;
  };
  const CapturedPairs pairs(field);
  const auto nearViews = neighbourhoods(towardsViews), nearLights = neighbourhoods(towardsLights);
  return std::ranges::all_of(nearViews, [&](const auto& views) {
    return std::ranges::all_of(nearLights, [&](const auto& lights) {
      size_t missing = 0;
      for (const uint32_t view : views)
        for (const uint32_t light : lights) missing += pairs.numberOf(view, light) == CapturedPairs::kMissing;
      return 4 * missing <= views.size() * lights.size();
    });
  });
}

RequestedPair requestedPair(const Direction3<AcquisitionSpace>& light,
                            const Direction3<AcquisitionSpace>& view, float shadow,
                            const KrigingScales& scales) {
  const Vec3<float> half = halfVector(light.raw(), view.raw());
  const auto inverseSquare = [](float scale) { return 1 / (scale * scale); };
  return {{light.x(), light.y(), light.z()}, {view.x(), view.y(), view.z()},
          {half[0], half[1], half[2]},       shadow,
          inverseSquare(scales.half),        inverseSquare(scales.light),
          inverseSquare(scales.view),        1 / scales.shadow};
}

HWY_EXPORT(writePairPenalties);
void writePairPenalties(const NearPairs& pairs, const RequestedPair& asked, float* penalties) {
  HWY_DYNAMIC_DISPATCH(writePairPenalties)(pairs, asked, penalties);
}

HWY_EXPORT(findLeast);
size_t findLeast(float* penalties, size_t count, size_t most, uint32_t* places, float* least) {
  return HWY_DYNAMIC_DISPATCH(findLeast)(penalties, count, most, places, least);
}

} // namespace surflect::weights
#endif
