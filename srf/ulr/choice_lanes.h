// Which of many cameras or lights answer for a direction, and how much each: ulrWeights, for sixteen queries
// at once in vector lanes of single precision. What a query gets does not depend on the others.
#pragma once

#include "srf/ulr/choice_kernels.h"
#include "srf/ulr/ulr.h"
#include "srf/ulr/visibility_weights.h"
#include "surfel/math/simd.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::ulr {

// What a direction leads to: a place, or something so distant that the direction to it is everywhere the
// same, unit length.
struct Source {
  Vec3<double> place;
  bool isDistant = false;
};

// The blends of up to kChoiceLanes queries, each a lane.
class LaneBlends {
public:
  // As ulrWeights of all that were rated, but for the rounding of penalties: those of directions that are 10
  // roundings apart, and of five roundings more.
  BlendSet of(size_t lane) const;

  // The same one by one: use(index, weight).
  template <class Use> void forEach(size_t lane, const Use& use) const {
    for (size_t i = 0; i < blended_; ++i)
      if (weight(lane, i) > 0) use(index(lane, i), weight(lane, i));
  }

  // How many are blended where none of the weights is 0, their indices and weights; as forEach has them.
  size_t size() const { return blended_; }
  uint32_t index(size_t lane, size_t i) const { return static_cast<uint32_t>(nearest_.index[i][lane]); }
  float weight(size_t lane, size_t i) const { return weights_[i * kChoiceLanes + lane]; }

  // Is every lane sure, and none of its weights 0?
  bool areWhole() const { return lost_ == 0 && whole_ == 0xffff; }

  // Of the nearest; infinite where there is none.
  float penalty(size_t lane) const { return nearest_.penalty[0][lane]; }

  // False where single precision has lost a direction: a source is nearer than 1e-15 or farther than 1e15.
  // The blend then means nothing.
  bool isSure(size_t lane) const { return (lost_ >> lane & 1) == 0; }

private:
  friend class LightLanes;
  friend class ViewLanes;
  size_t blended_ = 0, sources_ = 0;
  uint32_t lost_ = 0, whole_ = 0; // a bit for each lane
  NearestLanes nearest_{};
  std::array<float, kMaxBlended * kChoiceLanes> weights_{};
};

// All lights of a rig are seen from everywhere.
class LightLanes {
public:
  LightLanes(std::span<const Source> lights, Simd simd); // fewer than 2^24

  // Where the next queries are; 1..kChoiceLanes.
  void lookFrom(std::span<const Point3<AcquisitionSpace>> places);

  // Of the unit directions asked for, one per place, the `count` nearest, 1..kMaxBlended. It takes less time
  // where these have been found near to those that the blends held before.
  void blend(std::span<const Direction3<AcquisitionSpace>> towards, size_t count, LaneBlends& blends);

private:
  const ChoiceKernels& kernels_;
  std::vector<SplitSource> sources_;
  std::vector<float> towards_; // x, y, z in lanes, of each source
  bool allDistant_ = true;
  uint32_t lost_ = 0;
};

// Sources as lanes, padded with some that are distant and lead nowhere.
struct SourceLanes {
  explicit SourceLanes(std::span<const Source> sources);

  size_t count = 0, groups = 0;
  std::vector<float> x, y, z, rest, isNear;
};

// One query that looks at all sources.
class SourceLook {
public:
  SourceLook(std::span<const Source> sources, Simd simd)
      : kernels_(choiceKernels(simd)), sources_(sources), penalties_(sources_.x.size()),
        cosines_(sources_.x.size()) {}

  static constexpr float kError = 2e-6f; // of both

  void look(const Point3<AcquisitionSpace>& place, const Direction3<AcquisitionSpace>& towards,
            const Normal3<AcquisitionSpace>& normal);

  // Per source: 1 - cos of the angle from the direction asked for, and cosine to the normal; both 0 where the
  // source is nearer than 1e-15 or farther than 1e15.
  std::span<const float> penalties() const { return {penalties_.data(), sources_.count}; }
  std::span<const float> cosines() const { return {cosines_.data(), sources_.count}; }

private:
  const ChoiceKernels& kernels_;
  SourceLanes sources_;
  std::vector<float> penalties_, cosines_;
};

// Around places within `radius` of a middle and directions within `spread` of another: sources that have a
// penalty within the limit for any of these are in the cone, if none is nearer to the middle than `distance`.
ChoiceCone coneAround(const std::array<float, 3>& place, float radius, float distance,
                      const std::array<float, 3>& towards, float spread, float limit);

// Views have fades, by which their penalties are divided. Of hundreds few can be among the nearest of
// queries that lie beside each other, as those along a curve do; it is these that are rated.
class ViewLanes {
public:
  // The fades are those of as many views, and must outlive this.
  ViewLanes(std::span<const Source> views, const VisibilityWeights& fades, Simd simd); // fewer than 2^24

  // From surfels and their places, 1..kChoiceLanes, of the unit directions asked for the `count` nearest,
  // 1..kMaxBlended. Views of no fade are not asked. Valid until the next call.
  const LaneBlends& blend(std::span<const uint32_t> surfels, std::span<const Point3<AcquisitionSpace>> places,
                          std::span<const Direction3<AcquisitionSpace>> towards, size_t count);

  // Asks the processor for what the next blend most likely reads of these surfels' fades. Not a call: for the
  // compiler it would have no effect, and be left out.
  [[gnu::always_inline]] void fetchFades(std::span<const uint32_t> surfels) const {
    for (const uint32_t surfel : surfels)
      for (const uint32_t view : apart_) __builtin_prefetch(&fades_.of(surfel)[view]);
  }

private:
  void keepApart();
  void rate(std::span<const uint32_t> views, std::span<const uint32_t> surfels, const float* places,
            const float* towards, size_t slots);
  float leastDistance(const std::array<float, 3>& place);
  float missing(float limit, size_t count, std::span<const uint32_t> surfels) const;
  bool seeNoMore(size_t lane, size_t most, uint32_t surfel) const;

  const ChoiceKernels& kernels_;
  const VisibilityWeights& fades_;
  std::vector<SplitSource> sources_;
  SourceLanes lanes_;
  float farthest_ = 0;                 // coordinate of a place
  std::array<float, 256> inverseFade_; // of a byte
  std::vector<float> towards_, inverseFades_;
  std::vector<uint32_t> found_;
  size_t rated_ = 0;            // of those found
  std::vector<uint32_t> apart_; // of those rated, the ones that fetchFades asks for
  float limit_;                 // penalty: what the next queries likely need
  std::array<float, 3> measured_{};
  float nearest_ = 0; // distance of a view from the place that was measured
  LaneBlends blends_;
};

} // namespace surflect::ulr
