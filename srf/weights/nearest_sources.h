// Cameras or lights nearest to a direction, and their ULR weights, for batches of sixteen queries in vector
// lanes, in single precision. The result of a query does not depend on the others in its batch.
//
//   p_i = (1 - cos theta_i) / s_i,  w_i = ulrWeights of the k + 1 least p_i   (ulr.h)
//
// Symbols: theta_i angle between the requested direction and the direction to source i, s_i visibility weight
// of a camera (visibility_weights.h), 1 for a light.  [Weyrich 2005, §5.2; Buehler 2001, §4]
#pragma once

#include "srf/capture/capture.h"
#include "srf/weights/nearest_kernels.h"
#include "srf/weights/ulr.h"
#include "srf/weights/visibility_weights.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::weights {

// A camera or light: a place, or the direction of a distant source.
struct Source {
  Vec3<double> place; // or unit direction
  bool isDistant = false;
};

std::vector<Source> sourcesOf(std::span<const capture::Viewpoint<AcquisitionSpace>> viewpoints);

// Viewpoints of the cameras, or at the lights.
std::vector<capture::Viewpoint<AcquisitionSpace>> viewpointsOf(std::span<const capture::View> views);
std::vector<capture::Viewpoint<AcquisitionSpace>> viewpointsOf(std::span<const capture::Light> lights);

// The blends of up to kQueryLanes queries, one per lane.
class QueryBlends {
public:
  // The blend of a lane, equal to ulrWeights up to rounding: directions err by 10 roundings, penalties by 5
  // more.
  BlendSet of(size_t lane) const;

  // Calls use(index, weight) for each source of nonzero weight.
  template <class Use> void forEach(size_t lane, const Use& use) const {
    for (size_t i = 0; i < blended_; ++i)
      if (weight(lane, i) > 0) use(index(lane, i), weight(lane, i));
  }

  // Number, indices and weights of the blended sources, including those of weight 0.
  size_t size() const { return blended_; }
  uint32_t index(size_t lane, size_t i) const { return static_cast<uint32_t>(nearest_.index[i][lane]); }
  float weight(size_t lane, size_t i) const { return weights_[i * kQueryLanes + lane]; }

  // The sources of least penalty, ascending: one more than are blended, where there are so many.
  NearestCandidates candidates(size_t lane) const {
    NearestCandidates nearest(blended_);
    for (size_t i = 0; i <= blended_; ++i) nearest.offer({index(lane, i), nearest_.penalty[i][lane]});
    return nearest;
  }

  bool areAllPrecise() const { return lost_ == 0; } // see isPrecise

  // Least penalty; infinite if there is no source.
  float penalty(size_t lane) const { return nearest_.penalty[0][lane]; }

  // False if single precision lost a direction, as a source is nearer than 1e-15 or farther than 1e15; the
  // blend is then undefined.
  bool isPrecise(size_t lane) const { return (lost_ >> lane & 1) == 0; }

private:
  friend class NearestLights;
  friend class NearestViews;
  size_t blended_ = 0, sources_ = 0;
  uint32_t lost_ = 0; // one bit for each lane
  NearestOfQueries nearest_{};
  std::array<float, kMaxBlended * kQueryLanes> weights_{};
};

// The nearest lights. Every light is a candidate at every place.
class NearestLights {
public:
  // Fewer than 2^24 lights. Blends are truncated by `error` (ulr.h).
  explicit NearestLights(std::span<const Source> lights, float error = 0);

  // Sets the places of the next queries (1..kQueryLanes).
  void setPlaces(std::span<const Point3<AcquisitionSpace>> places);

  // Blends the `count` lights (1..kMaxBlended) nearest to the requested unit directions, one for each place.
  // Faster if `blends` holds the result of similar directions.
  void blend(std::span<const Direction3<AcquisitionSpace>> towards, size_t count, QueryBlends& blends);

private:
  std::vector<SplitSource> sources_;
  std::vector<float> towards_; // x, y, z in lanes, for each source
  bool allDistant_ = true;
  float error_;
  uint32_t lost_ = 0;
};

// The cone that holds every source whose penalty is within `limit` for any query of a batch. Places lie
// within `radius` of `place`, directions within `spread` of `towards`; no source is nearer to `place` than
// `distance`.
SourceCone coneAround(const std::array<float, 3>& place, float radius, float distance,
                      const std::array<float, 3>& towards, float spread, float limit);

// Nearest views. Of hundreds of views, only a few can be among the nearest to neighbouring queries; penalties
// are computed for these few only.
class NearestViews {
public:
  // Fewer than 2^24 views; `visibility` has one column per view and must outlive this. Blends are truncated
  // by `error` (ulr.h).
  NearestViews(std::span<const Source> views, const VisibilityWeights& visibility, float error = 0);

  // Blends the `count` views (1..kMaxBlended) nearest to the requested unit directions, at 1..kQueryLanes
  // surfels and their places. Views whose fade is 0 are left out. The result is valid until the next call.
  const QueryBlends& blend(std::span<const uint32_t> surfels,
                           std::span<const Point3<AcquisitionSpace>> places,
                           std::span<const Direction3<AcquisitionSpace>> towards, size_t count);

  // Prefetches the fades of these surfels that the next blend most likely reads. Inlined, since compilers
  // drop a call whose only effect is prefetching.
  [[gnu::always_inline]] void prefetchFades(std::span<const uint32_t> surfels) const {
    for (const uint32_t surfel : surfels)
      for (const uint32_t view : apart_) __builtin_prefetch(&visibility_.of(surfel)[view]);
  }

private:
  void keepApart();
  void rate(std::span<const uint32_t> views, std::span<const uint32_t> surfels, const float* places,
            const float* towards, size_t slots);
  float leastDistance(const std::array<float, 3>& place);
  float missing(float limit, size_t count, std::span<const uint32_t> surfels) const;
  bool seeNoMore(size_t lane, size_t most, uint32_t surfel) const;

  const VisibilityWeights& visibility_;
  const float error_;
  std::vector<SplitSource> sources_;
  size_t groups_ = 0;                     // of kQueryLanes views
  std::vector<float> x_, y_, z_, isNear_; // of views, padded with distant ones without direction
  float farthest_ = 0;                    // largest coordinate of a view
  std::array<float, 256> inverseFade_;    // by encoded fade
  std::vector<float> towards_, inverseFades_;
  std::vector<uint32_t> found_;
  size_t rated_ = 0;                // views in found_ whose penalties were computed
  std::vector<uint32_t> apart_;     // views in found_ whose fades are prefetched
  float limit_;                     // penalty within which the next queries are likely to find their views
  std::array<float, 3> measured_{}; // place that nearest_ was measured from
  float nearest_ = 0;               // distance of the nearest view
  QueryBlends blends_;
};

} // namespace surflect::weights
