#include "apps/frame_range.h"

#include "surfel/base/error.h"

#include <fmt/format.h>

#include <charconv>
#include <string_view>

namespace surflect {

FrameRange parseRange(const std::string& text, const scene::Frames& frames) {
  if (text.empty()) return {frames.first, frames.last};
  const auto complain = [&] {
    return Error::mismatch(fmt::format("A or A-B within {}-{}", frames.first, frames.last), "'" + text + "'")
        .at("--frames");
  };
  const auto number = [&](std::string_view digits) {
    int value = 0;
    const auto [stop, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (status != std::errc() || stop != digits.data() + digits.size()) throw complain();
    return value;
  };
  const size_t dash = text.find('-');
  const FrameRange range{number(std::string_view(text).substr(0, dash)),
                         number(dash == std::string::npos ? text : std::string_view(text).substr(dash + 1))};
  if (range.first > range.last || range.first < frames.first || range.last > frames.last) throw complain();
  return range;
}

} // namespace surflect
