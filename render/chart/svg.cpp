#include "render/chart/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <limits>

namespace surflect::chart {

namespace {

// Value of a decimal number; 0 where it is too small or too large for a double.
double parsed(const std::string& decimal) {
  double value = 0;
  std::from_chars(decimal.data(), decimal.data() + decimal.size(), value);
  return value;
}

} // namespace

std::string rounded(double number, int digits) {
  if (std::isnan(number)) return "–";
  if (std::isinf(number)) return number > 0 ? "∞" : "−∞";
  // Rounding first: 9.96 has one digit before the point, 10.0 has two.
  const double exact = parsed(fmt::format("{:.{}e}", number, digits - 1));
  if (exact == 0) return "0";
  const int before = static_cast<int>(std::floor(std::log10(std::abs(exact)))) + 1;
  const std::string text = fmt::format("{:.{}f}", exact, std::max(0, digits - before));
  return text.starts_with('-') ? "−" + text.substr(1) : text;
}

std::string shortest(double number, int digits) {
  std::string text = rounded(number, digits);
  if (text.find('.') == std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

double Axis::position(double value) const {
  const double share =
      isLogarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  return first + share * (last - first);
}

Axis axisAround(std::span<const double> values, bool isLogarithmic, double first, double last) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : values) {
    if (!std::isfinite(value) || (isLogarithmic && value <= 0)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  constexpr double margin = 0.07;
  if (isLogarithmic) {
    if (low > high) low = high = 1;
    const double factor = std::max(std::pow(high / low, margin), low == high ? 1.5 : 1.02);
    return {true, low / factor, high * factor, first, last};
  }
  if (low > high) low = high = 0;
  const double pad = low == high ? std::max(0.05 * std::abs(low), 1e-6) : margin * (high - low);
  return {false, low - pad, high + pad, first, last};
}

namespace {

// Multiples of the mantissas with powers of ten, within the range.
std::vector<double> logarithmicTicks(const Axis& axis, std::span<const double> mantissas, int everyDecade) {
  std::vector<double> found;
  const int lowest = static_cast<int>(std::floor(std::log10(axis.low))),
            highest = static_cast<int>(std::ceil(std::log10(axis.high)));
  for (int decade = lowest; decade <= highest; ++decade) {
    if (decade % everyDecade != 0) continue;
    for (const double mantissa : mantissas) {
      // Parsed, because a product of a mantissa and a power is not the nearest number: 3 * 0.1.
      const double tick = parsed(fmt::format("{}e{}", mantissa, decade));
      if (tick >= axis.low && tick <= axis.high) found.push_back(tick);
    }
  }
  return found;
}

std::vector<double> linearTicks(const Axis& axis, size_t most) {
  const double least = (axis.high - axis.low) / static_cast<double>(most);
  for (int decade = static_cast<int>(std::floor(std::log10(least))); true; ++decade) {
    for (const int digit : {1, 2, 5}) {
      const double step = digit * std::pow(10.0, decade);
      const double start = std::ceil(axis.low / step), stop = std::floor(axis.high / step);
      if (stop - start + 1 > static_cast<double>(most)) continue;
      std::vector<double> found;
      for (double k = start; k <= stop; ++k) found.push_back(parsed(fmt::format("{}e{}", k * digit, decade)));
      return found;
    }
  }
}

} // namespace

std::vector<double> ticks(const Axis& axis, size_t most) {
  assert(most >= 2 && axis.low < axis.high);
  if (!axis.isLogarithmic) return linearTicks(axis, most);
  constexpr double all[] = {1, 2, 3, 4, 5, 6, 7, 8, 9}, fine[] = {1, 2, 5}, coarse[] = {1, 3}, powers[] = {1};
  std::vector<double> found = logarithmicTicks(axis, all, 1);
  if (found.size() < 2) return linearTicks(axis, most);
  if (found.size() > most) found = logarithmicTicks(axis, fine, 1);
  if (found.size() > most) found = logarithmicTicks(axis, coarse, 1);
  for (int every = 1; found.size() > most; ++every) found = logarithmicTicks(axis, powers, every);
  return found;
}

std::string mark(size_t kind, Place place, double radius, std::string_view classes) {
  const auto [x, y] = place;
  const double r = radius;
  switch (kind % kMarks) {
  case 0:
    return fmt::format(R"(<circle class="{}" cx="{:.1f}" cy="{:.1f}" r="{:.1f}"/>)", classes, x, y, r);
  case 1:
    return fmt::format(R"(<rect class="{}" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>)", classes,
                       x - 0.88 * r, y - 0.88 * r, 1.76 * r, 1.76 * r);
  case 2:
    return fmt::format(R"(<path class="{}" d="M{:.1f} {:.1f}l{:.1f} {:.1f}h{:.1f}z"/>)", classes, x,
                       y - 1.2 * r, 1.15 * r, 2 * r, -2.3 * r);
  default:
    return fmt::format(R"(<path class="{}" d="M{:.1f} {:.1f}l{:.1f} {:.1f}l{:.1f} {:.1f}l{:.1f} {:.1f}z"/>)",
                       classes, x, y - 1.25 * r, 1.25 * r, 1.25 * r, -1.25 * r, 1.25 * r, -1.25 * r,
                       -1.25 * r);
  }
}

std::string line(std::span<const Place> places, std::string_view classes) {
  if (places.size() < 2) return "";
  std::string points;
  for (const auto& [x, y] : places) points += fmt::format("{}{:.1f},{:.1f}", points.empty() ? "" : " ", x, y);
  return fmt::format(R"(<polyline class="{}" points="{}"/>)", classes, points);
}

std::string text(Place place, std::string_view anchor, std::string_view content, std::string_view classes) {
  return fmt::format(R"(<text class="{}" x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>)", classes, place.x,
                     place.y, anchor, escaped(content));
}

double overlap(const Box& a, const Box& b) {
  const double width = std::min(a.x + a.width, b.x + b.width) - std::max(a.x, b.x),
               height = std::min(a.y + a.height, b.y + b.height) - std::max(a.y, b.y);
  return width > 0 && height > 0 ? width * height : 0;
}

namespace {

// Square around a mark.
Box around(Place place, double radius) {
  return {place.x - radius, place.y - radius, 2 * radius, 2 * radius};
}

} // namespace

std::vector<Box> placeLabels(std::span<const Place> labelled, std::span<const std::array<double, 2>> sizes,
                             std::span<const Place> marks, const Box& bounds) {
  assert(labelled.size() == sizes.size());
  std::vector<Box> placed;
  for (size_t i = 0; i < labelled.size(); ++i) {
    const auto [width, height] = sizes[i];
    Box best;
    double least = std::numeric_limits<double>::infinity();
    for (const double distance : {9.0, 16.0, 26.0, 40.0, 58.0, 80.0}) {
      for (int direction = 0; direction < 16; ++direction) {
        // The box touches the circle of the given distance from outside.
        const double angle = direction * 0.39269908169872414, c = std::cos(angle), s = std::sin(angle);
        Box box{labelled[i].x + c * distance + (c - 1) / 2 * width,
                labelled[i].y - s * distance + (-s - 1) / 2 * height, width, height};
        box.x = std::clamp(box.x, bounds.x, std::max(bounds.x, bounds.x + bounds.width - width));
        box.y = std::clamp(box.y, bounds.y, std::max(bounds.y, bounds.y + bounds.height - height));
        double cost = distance; // square units of covered label weigh more than any distance
        for (const Box& other : placed) cost += 100 * overlap(box, other);
        for (const Place& place : labelled) cost += 10 * overlap(box, around(place, 7));
        for (const Place& place : marks) cost += 0.4 * overlap(box, around(place, 3.5));
        if (cost < least) least = cost, best = box;
      }
    }
    placed.push_back(best);
  }
  return placed;
}

} // namespace surflect::chart
