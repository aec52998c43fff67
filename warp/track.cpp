#include "warp/track.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <cmath>

namespace surflect::warp {

namespace {

double interpolate(std::span<const Keyframe> keys, double frame) {
  const auto next = std::upper_bound(keys.begin(), keys.end(), frame,
                                     [](double f, const Keyframe& key) { return f < key.frame; });
  if (next == keys.begin()) return keys.front().value;
  if (next == keys.end()) return keys.back().value;
  const Keyframe& from = *(next - 1);
  const double x = (frame - from.frame) / (next->frame - from.frame);
  const double weight = next->smooth ? x * x * (3 - 2 * x) : x;
  return (1 - weight) * from.value + weight * next->value;
}

} // namespace

Track Track::keyframes(std::vector<Keyframe> keys) {
  if (keys.empty()) throw Error::mismatch("at least one [frame, value]", "no keyframe");
  for (size_t i = 0; i < keys.size(); ++i) {
    if (!std::isfinite(keys[i].frame) || !std::isfinite(keys[i].value))
      throw Error::mismatch("finite numbers", "inf or nan in keyframe " + std::to_string(i + 1));
    if (i > 0 && !(keys[i].frame > keys[i - 1].frame))
      throw Error::mismatch("frames that increase",
                            numberText(keys[i].frame) + " after " + numberText(keys[i - 1].frame));
  }
  return Track(Source(std::move(keys)));
}

Track Track::expression(std::string text) {
  constexpr std::array<std::string_view, 3> variables = {"t", "frame", "s"};
  return Track(Source(Expression(std::move(text), variables)));
}

Track Track::plus(double offset) const {
  Track sum = *this;
  sum.offset_ += offset;
  return sum;
}

double Track::at(const ShotTime& time) const {
  if (const auto* literal = std::get_if<double>(&source_)) return *literal + offset_;
  if (const auto* keys = std::get_if<std::vector<Keyframe>>(&source_))
    return interpolate(*keys, time.frame) + offset_;
  return std::get<Expression>(source_)(std::array{time.t, time.frame, time.s}) + offset_;
}

double finiteAt(const Track& track, const ShotTime& time, std::string_view field) {
  const double value = track.at(time);
  if (!std::isfinite(value))
    throw Error::mismatch("a finite number", numberText(value) + " at frame " + numberText(time.frame))
        .at(field);
  return value;
}

Vec3<double> finiteAt(const Track3& track, const ShotTime& time, std::string_view field) {
  Vec3<double> value;
  for (int i = 0; i < 3; ++i)
    value[i] =
        finiteAt(track[static_cast<size_t>(i)], time, std::string(field) + '[' + std::to_string(i) + ']');
  return value;
}

Vec3<double> unitAt(const Track3& track, const ShotTime& time, std::string_view field) {
  const Vec3<double> unit = finiteAt(track, time, field).stableNormalized();
  if (!(unit.squaredNorm() > 0.5))
    throw Error::mismatch("a direction", "length 0 at frame " + numberText(time.frame)).at(field);
  return unit;
}

} // namespace surflect::warp
