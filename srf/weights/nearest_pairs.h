// (Camera, light) pairs of a capture, and the pairs of the nearest cameras and lights with their penalties
// under kriging, in vector lanes.
#pragma once

#include "srf/weights/kriging.h"
#include "srf/weights/reflectance_field.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::weights {

// The pairs that were photographed, numbered view by view in the order of columns.
class CapturedPairs {
public:
  static constexpr uint32_t kMissing = 0xffffffff; // number of a pair that was not photographed

  explicit CapturedPairs(const ReflectanceField& field);

  struct Pair {
    uint32_t view, column, light;
  };
  const Pair& operator[](uint32_t number) const { return pairs_[number]; }
  size_t size() const { return pairs_.size(); }
  size_t firstOf(size_t view) const { return firstPair_[view]; }
  uint32_t numberOf(size_t view, size_t light) const { return numbers_[view * lights_ + light]; }

private:
  size_t lights_;
  std::vector<Pair> pairs_;
  std::vector<size_t> firstPair_; // of each view
  std::vector<uint32_t> numbers_; // by view and light
};

inline constexpr size_t kNearSources = 6; // nearest views, and lights, whose pairs are considered
inline constexpr size_t kPairLanes = 8;   // lanes of a row of pairs, of which the last hold none
inline constexpr size_t kNearPairs = kNearSources * kPairLanes;

// True if pairs of the nearest views and lights suffice, as in a full product: at most a quarter of the pairs
// is missing among the kNearSources nearest views of any view and the nearest lights of any light, seen from
// the middle of the cloud. False for a capture with wide gaps. Costs about 40 look-ups for each pair of a
// capture with gaps.
bool hasNearPairs(const ReflectanceField& field);

// Nearness n of a view or light among the nearest: 1 up to a quarter of the threshold of ULR, then falling
// evenly to 0 at the threshold. It falls slowly, since neighbouring photographs can differ by a whole
// highlight: weight moves from one to the next while a lamp crosses the gap between captured lights. Where
// all penalties equal the threshold, the nearest have 1.
inline float nearness(float penalty, float least, float threshold) {
  constexpr float kNearUpTo = 0.25f;
  if (!(least < threshold)) return penalty <= least ? 1 : 0;
  return std::clamp((1 - penalty / threshold) / (1 - kNearUpTo), 0.f, 1.f);
}

// Calls use(index, penalty, nearness) for each of the kNearSources nearest.
template <class Use> void forEachNear(const NearestCandidates& nearest, const Use& use) {
  const auto sorted = nearest.sorted();
  if (sorted.empty()) return;
  const float threshold = thresholdPenalty(sorted, kNearSources);
  for (const auto& [index, penalty] : sorted.first(std::min(kNearSources, sorted.size())))
    use(index, penalty, nearness(penalty, sorted[0].penalty, threshold));
}

// Views or lights, one a lane. Lanes without one have confidence 0.
struct NearSources {
  size_t size = 0; // at most kNearSources
  std::array<uint32_t, kNearSources> index;
  std::array<float, kPairLanes> x{}, y{}, z{}; // unit directions towards them
  std::array<float, kPairLanes> confidence{};
  std::array<float, kPairLanes> reached{}; // shadow states of lights

  void clear() {
    size = 0;
    confidence.fill(0);
  }
  void add(uint32_t source, const Direction3<AcquisitionSpace>& towards, float trust, float shadowState = 1) {
    index[size] = source;
    x[size] = towards.x(), y[size] = towards.y(), z[size] = towards.z();
    confidence[size] = trust;
    reached[size++] = shadowState;
  }
  Direction3<AcquisitionSpace> towards(size_t i) const { return {x[i], y[i], z[i]}; }
};

// The pairs of each viewer with each light. The pair of viewer v and light l has the place kPairLanes v + l.
struct NearPairs {
  NearSources viewers = {}, lights = {};
  bool isExchanged = false; // viewers are lights of the rig, and lights its views (reciprocity.h)

  size_t size() const { return kPairLanes * viewers.size; }
  template <class Use> void forEach(const Use& use) const {
    for (size_t viewer = 0; viewer < viewers.size; ++viewer)
      for (size_t light = 0; light < lights.size; ++light) use(kPairLanes * viewer + light);
  }
  float confidence(size_t pair) const {
    return viewers.confidence[pair / kPairLanes] * lights.confidence[pair % kPairLanes];
  }
  PairPlace place(size_t pair, const KrigingScales& scales) const {
    const size_t light = pair % kPairLanes;
    return pairPlace(lights.towards(light), viewers.towards(pair / kPairLanes), lights.reached[light],
                     scales);
  }
  uint32_t numberIn(const CapturedPairs& pairs, size_t pair) const {
    const uint32_t viewer = viewers.index[pair / kPairLanes], light = lights.index[pair % kPairLanes];
    return isExchanged ? pairs.numberOf(light, viewer) : pairs.numberOf(viewer, light);
  }
};

// Requested pair, and the squared inverse of each scale (kriging.h).
struct RequestedPair {
  float light[3], view[3], half[3]; // unit directions; halfVector of both
  float shadow;                     // shadow state
  float ofHalf, ofLight, ofView;
  float ofShadow; // inverse, not squared
};
RequestedPair requestedPair(const Direction3<AcquisitionSpace>& light,
                            const Direction3<AcquisitionSpace>& view, float shadow,
                            const KrigingScales& scales);

// Writes the krigingPenalty of each pair at penalties[its place], divided by the confidence in both sources;
// infinite where that is 0. Squared distances are those of places (kriging.h) within 1e-6 ofHalf, or 2e-5
// ofHalf near opposite directions. Every instruction set gives the same bits.
void writePairPenalties(const NearPairs& pairs, const RequestedPair& asked, float* penalties);

// Writes the places of the `most` least of `count` penalties, ascending; of equal ones the first comes first.
// Infinite and NaN penalties are left out. Returns how many places were written. `count` is a multiple of
// kPairLanes; `penalties` is overwritten.
size_t findLeast(float* penalties, size_t count, size_t most, uint32_t* places, float* least);

} // namespace surflect::weights
