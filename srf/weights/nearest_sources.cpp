// Error bounds of penalties, and the proof that no source is missed. u = 2^-24.
//
// (1) A source's place is kept as two floats, with a relative error of u^2; a surfel's place is a float. The
// difference (first - place) + rest therefore errs by 3 u in each coordinate, even under cancellation.
// Length, inverse and product add up to 9 u for the unit direction; the direction of the exact definition,
// computed in double precision, is rounded by u. Penalties of directions 10 u apart differ by 10 u sqrt(2 p),
// plus their own rounding of 5 u p.
//
// (2) The directions to a view from all places within r of a middle at distance d differ from the middle's
// direction by at most 2 r / (2 d - r), since |a/|a| - b/|b|| <= 2 |a - b| / (|a| + |b|)  [Dunkl, Williams
// 1964]. The requested directions lie within s of their own middle q. By the triangle inequality, the chord
// |u - q| from the middle's direction u is at most sqrt(2 p) of any query plus both of these distances; p is
// at most the query's penalty, as no fade exceeds 1. For a view within the limit, u . q = (1 + |q|^2 -
// |u - q|^2) / 2 is at least its value for the longest chord, so that the view lies in a cone. kChordSlack
// and kProductSlack absorb rounding, including the kernel's 1e-6 and the 10 u.
//
// (3) The first limit is slightly above the largest penalty that a query of the previous batch needed. If a
// query needs more, all views in a cone of that larger limit are rated, since the penalty found is an upper
// bound. If a query found too few views although more see its surfel, the limit kGuess is tried, then all
// views. This terminates: an upper bound suffices, kGuess comes once, and a cone without limit holds every
// view. Rating extra views does not change the result.
//
// (4) Before a penalty p = |a - b|^2 / 2 is computed, the cosine a . b = (|a|^2 + |b|^2) / 2 - p shows
// whether p can be within the limit. Half of each square is 1/2 within 9 u, for the direction computed here
// and for the given one; the product errs by 3 u and the penalty by 10 u. The sum of 31 u is 2e-6, and the
// kernel allows twice as much.
//
// [Dunkl, Williams 1964] Dunkl, Williams: A Simple Norm Inequality, Amer. Math. Monthly 71.
#include "srf/weights/nearest_sources.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::weights {

namespace {

constexpr float kChordSlack = 1e-5f, kProductSlack = 2e-6f;
constexpr float kGuess = 1 / 8.f;              // penalty
constexpr float kMargin = 1.25f;               // limit for a batch, relative to what the previous one needed
static_assert(kMaxNearest == kMaxBlended + 1); // the blended sources, and one for the threshold
using LaneVectors = std::array<float, 3 * kQueryLanes>;
constexpr std::array<float, kQueryLanes> unlimited = [] {
  std::array<float, kQueryLanes> limits{};
  limits.fill(kInfinity);
  return limits;
}();

SplitSource split(const Source& source) {
  const Vec3<float> first = source.place.cast<float>(),
                    rest = (source.place - first.cast<double>()).cast<float>();
  return {first[0], first[1], first[2], rest[0], rest[1], rest[2], source.isDistant};
}

std::vector<SplitSource> splitAll(std::span<const Source> sources) {
  std::vector<SplitSource> all;
  for (const Source& source : sources) all.push_back(split(source));
  return all;
}

// Copies vectors to lanes; unused lanes repeat the last vector.
template <class Vector> LaneVectors lanesOf(std::span<const Vector> vectors) {
  assert(!vectors.empty() && vectors.size() <= kQueryLanes);
  LaneVectors lanes;
  for (size_t lane = 0; lane < kQueryLanes; ++lane) {
    const Vector& v = vectors[std::min(lane, vectors.size() - 1)];
    lanes[lane] = v.x();
    lanes[kQueryLanes + lane] = v.y();
    lanes[2 * kQueryLanes + lane] = v.z();
  }
  return lanes;
}

// Centre of the vectors' bounding box, and the distance of the farthest vector from it.
struct Around {
  std::array<float, 3> middle;
  float reach;
};
Around around(const LaneVectors& lanes) {
  Around all{};
  for (size_t axis = 0; axis < 3; ++axis) {
    const float* values = lanes.data() + axis * kQueryLanes;
    float low = values[0], high = values[0];
    for (size_t lane = 1; lane < kQueryLanes; ++lane) {
      low = std::min(low, values[lane]);
      high = std::max(high, values[lane]);
    }
    all.middle[axis] = (low + high) / 2;
  }
  float squared = 0;
  for (size_t lane = 0; lane < kQueryLanes; ++lane) {
    const float x = lanes[lane] - all.middle[0], y = lanes[kQueryLanes + lane] - all.middle[1],
                z = lanes[2 * kQueryLanes + lane] - all.middle[2];
    squared = std::max(squared, x * x + y * y + z * z);
  }
  all.reach = (1 + kChordSlack) * std::sqrt(squared);
  return all;
}

} // namespace

std::vector<Source> sourcesOf(std::span<const capture::Viewpoint<AcquisitionSpace>> viewpoints) {
  std::vector<Source> sources;
  for (const auto& viewpoint : viewpoints) sources.push_back({viewpoint.place(), viewpoint.isDistant()});
  return sources;
}

std::vector<capture::Viewpoint<AcquisitionSpace>> viewpointsOf(std::span<const capture::View> views) {
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints;
  for (const capture::View& view : views) viewpoints.emplace_back(view.camera);
  return viewpoints;
}

std::vector<capture::Viewpoint<AcquisitionSpace>> viewpointsOf(std::span<const capture::Light> lights) {
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints;
  for (const capture::Light& light : lights) {
    const auto* point = std::get_if<capture::PointLight>(&light.kind);
    viewpoints.emplace_back(point ? point->position.raw() : capture::towardsLight(light, {}).raw(), !point);
  }
  return viewpoints;
}

BlendSet QueryBlends::of(size_t lane) const {
  BlendSet blend;
  forEach(lane, [&](uint32_t index, float weight) { blend.push({index, weight}); });
  return blend;
}

SourceCone coneAround(const std::array<float, 3>& place, float radius, float distance,
                      const std::array<float, 3>& towards, float spread, float limit) {
  const float sweep = radius < distance / 2 ? 2 * radius / (2 * distance - radius) : kInfinity;
  const float chord = std::sqrt(2 * limit) + sweep + spread + kChordSlack;
  const float squared = towards[0] * towards[0] + towards[1] * towards[1] + towards[2] * towards[2];
  return {{place[0], place[1], place[2]},
          {towards[0], towards[1], towards[2]},
          (1 + squared - chord * chord) / 2 - kProductSlack};
}

NearestLights::NearestLights(std::span<const Source> lights, float error)
    : sources_(splitAll(lights)), towards_(3 * kQueryLanes * sources_.size()),
      allDistant_(std::ranges::all_of(lights, &Source::isDistant)), error_(error) {
  assert(lights.size() < size_t{1} << 24);
  if (allDistant_)
    writeDirections(sources_.data(), nullptr, sources_.size(), LaneVectors{}.data(), towards_.data());
}

void NearestLights::setPlaces(std::span<const Point3<AcquisitionSpace>> places) {
  if (allDistant_) return;
  const LaneVectors lanes = lanesOf(places);
  lost_ = writeDirections(sources_.data(), nullptr, sources_.size(), lanes.data(), towards_.data());
}

void NearestLights::blend(std::span<const Direction3<AcquisitionSpace>> towards, size_t count,
                          QueryBlends& blends) {
  assert(count >= 1 && count <= kMaxBlended);
  const LaneVectors lanes = lanesOf(towards);
  std::array<float, kQueryLanes> limits = unlimited;
  std::array<uint32_t, kMaxNearest> seeds;
  constexpr size_t middle = kQueryLanes / 2;
  size_t seeded = 0;
  if (blends.blended_ == count && blends.sources_ == sources_.size())
    while (seeded <= count && blends.nearest_.penalty[seeded][middle] < kInfinity) {
      seeds[seeded] = static_cast<uint32_t>(blends.nearest_.index[seeded][middle]);
      ++seeded;
    }
  if (seeded == count + 1)
    writeLargestPenalties(towards_.data(), seeds.data(), seeded, lanes.data(), limits.data());
  blends.blended_ = count;
  blends.sources_ = sources_.size();
  blends.lost_ = lost_;
  findNearest(towards_.data(), nullptr, nullptr, sources_.size(), lanes.data(), limits.data(), count + 1,
              blends.nearest_);
  writeWeights(blends.nearest_, count, error_, blends.weights_.data());
}

NearestViews::NearestViews(std::span<const Source> views, const VisibilityWeights& visibility, float error)
    : visibility_(visibility), error_(error), sources_(splitAll(views)),
      groups_((views.size() + kQueryLanes - 1) / kQueryLanes), limit_(kGuess) {
  assert(views.size() == visibility.views && views.size() < size_t{1} << 24);
  for (auto* values : {&x_, &y_, &z_, &isNear_}) values->resize(groups_ * kQueryLanes);
  for (size_t i = 0; i < sources_.size(); ++i) {
    x_[i] = sources_[i].x;
    y_[i] = sources_[i].y;
    z_[i] = sources_[i].z;
    isNear_[i] = sources_[i].isDistant ? 0 : 1;
  }
  for (const Source& view : views)
    if (!view.isDistant)
      farthest_ = std::max(farthest_, static_cast<float>(view.place.cwiseAbs().maxCoeff()));
  inverseFade_[0] = kInfinity;
  for (size_t byte = 1; byte < 256; ++byte)
    inverseFade_[byte] = 1 / VisibilityWeights::decode(static_cast<uint8_t>(byte));
  found_.resize(x_.size() + kQueryLanes);
  towards_.resize(3 * kQueryLanes * views.size());
  inverseFades_.resize(kQueryLanes * views.size());
}

void NearestViews::rate(std::span<const uint32_t> views, std::span<const uint32_t> surfels,
                        const float* places, const float* towards, size_t slots) {
  for (size_t lane = 0; lane < kQueryLanes; ++lane) {
    const uint8_t* visibility = visibility_.of(surfels[std::min(lane, surfels.size() - 1)]).data();
    for (size_t i = 0; i < views.size(); ++i)
      inverseFades_[i * kQueryLanes + lane] = inverseFade_[visibility[views[i]]];
  }
  blends_.lost_ = writeDirections(sources_.data(), views.data(), views.size(), places, towards_.data());
  findNearest(towards_.data(), views.data(), inverseFades_.data(), views.size(), towards, unlimited.data(),
              slots, blends_.nearest_);
}

// Selects, from the views whose penalties were computed last, some whose fades most likely lie in different
// cache lines.
void NearestViews::keepApart() {
  constexpr uint32_t kFar = 32; // bytes: half a line, wherever lines begin
  apart_.clear();
  for (const uint32_t view : std::span(found_).first(rated_))
    if (apart_.empty() || view >= apart_.back() + kFar) apart_.push_back(view);
}

// Returns true if at most `most` views see the surfel and the lane has found all of them.
bool NearestViews::seeNoMore(size_t lane, size_t most, uint32_t surfel) const {
  size_t found = 0;
  while (found < most && blends_.nearest_.penalty[found][lane] < kInfinity) ++found;
  const auto visibility = visibility_.of(surfel);
  return static_cast<size_t>(std::ranges::count_if(visibility, [](uint8_t fade) { return fade > 0; })) <=
         found;
}

// Lower bound on the distance of the nearest view to a place. All views are measured again only after the
// place has moved far.
float NearestViews::leastDistance(const std::array<float, 3>& place) {
  const auto squaredTo = [&](float x, float y, float z) {
    const float dx = x - place[0], dy = y - place[1], dz = z - place[2];
    return dx * dx + dy * dy + dz * dz;
  };
  constexpr float kFar = 1 / 8.f; // fraction of the distance
  const float moved = std::sqrt(squaredTo(measured_[0], measured_[1], measured_[2]));
  if (moved < kFar * nearest_ && nearest_ < kInfinity) return (1 - kChordSlack) * (nearest_ - moved);
  float squared = kInfinity;
  for (const SplitSource& view : sources_)
    if (!view.isDistant) squared = std::min(squared, squaredTo(view.x, view.y, view.z));
  measured_ = place;
  nearest_ = std::sqrt(squared);
  return (1 - kChordSlack) * nearest_;
}

// Largest penalty that a lane still needs, given the views within the limit; 0 if no lane needs more.
float NearestViews::missing(float limit, size_t count, std::span<const uint32_t> surfels) const {
  float most = 0;
  for (size_t lane = 0; lane < surfels.size(); ++lane) {
    const float last = blends_.nearest_.penalty[count][lane];
    if (last <= limit || (last == kInfinity && seeNoMore(lane, count, surfels[lane]))) continue;
    most = std::max(most, last);
  }
  return most;
}

const QueryBlends& NearestViews::blend(std::span<const uint32_t> surfels,
                                       std::span<const Point3<AcquisitionSpace>> places,
                                       std::span<const Direction3<AcquisitionSpace>> towards, size_t count) {
  assert(count >= 1 && count <= kMaxBlended);
  assert(surfels.size() == places.size() && surfels.size() == towards.size());
  const LaneVectors place = lanesOf(places), asked = lanesOf(towards);
  const Around placed = around(place), turned = around(asked);
  const float distance = leastDistance(placed.middle);
  // second term: rounding of the views' places
  const float radius = placed.reach + 4 * std::numeric_limits<float>::epsilon() * farthest_;
  for (float limit = limit_;;) {
    const SourceCone cone = coneAround(placed.middle, radius, distance, turned.middle, turned.reach, limit);
    rated_ = findInCone(x_.data(), y_.data(), z_.data(), isNear_.data(), groups_, cone, found_.data());
    while (rated_ > 0 && found_[rated_ - 1] >= sources_.size()) --rated_; // drops padding
    rate({found_.data(), rated_}, surfels, place.data(), asked.data(), count + 1);
    const float most = missing(limit, count, surfels);
    if (most == 0) break;
    limit = most < kInfinity || limit >= kGuess ? most : kGuess;
  }
  const float needed = *std::ranges::max_element(std::span(blends_.nearest_.penalty[count]));
  limit_ = needed < kInfinity ? kMargin * needed : kGuess;
  keepApart();
  blends_.blended_ = count;
  writeWeights(blends_.nearest_, count, error_, blends_.weights_.data());
  return blends_;
}

} // namespace surflect::weights
