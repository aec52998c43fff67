// A number over the time of a shot: a literal, keyframes, or an expression.
#pragma once

#include "surfel/math/space.h"
#include "warp/expression.h"

#include <array>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace surflect::warp {

struct ShotTime {
  double t = 0; // seconds since the first frame
  double frame = 0;
  double s = 0; // 0 at the first frame .. 1 at the last
};

struct Keyframe {
  double frame = 0, value = 0;
  bool smooth = false; // eases (3x^2 - 2x^3) the segment that ends at this key; otherwise linear
};

class Track {
public:
  Track(double literal = 0) : source_(literal) {}
  // Keyframes with increasing frames; constant before the first and after the last. Throws Error if there is
  // none, if frames do not increase, or a value is not finite.
  static Track keyframes(std::vector<Keyframe> keys);
  // Expression in t, frame and s. Throws Error as Expression does.
  static Track expression(std::string text);

  // This track with `offset` added to its value at all times.
  Track plus(double offset) const;

  // Value at a time; only expressions can give one that is not finite.
  double at(const ShotTime& time) const;

private:
  using Source = std::variant<double, std::vector<Keyframe>, Expression>;
  explicit Track(Source source) : source_(std::move(source)) {}
  Source source_;
  double offset_ = 0;
};

using Track3 = std::array<Track, 3>;

// Value at a time; throws Error at `field`, with the frame, if it is not finite.
double finiteAt(const Track& track, const ShotTime& time, std::string_view field);
Vec3<double> finiteAt(const Track3& track, const ShotTime& time, std::string_view field);
// Unit vector at a time; throws Error also if the length is zero.
Vec3<double> unitAt(const Track3& track, const ShotTime& time, std::string_view field);

} // namespace surflect::warp
