// Parts of an SVG plot: axes, ticks, marks, lines, and labels that do not overlap.
//
// Positions are in the user units of the SVG; y points down. Classes name rules of the page's style sheet.
#pragma once

#include "surfel/base/text.h"

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::chart {

// Number for readers with `digits` significant digits and without an exponent: "44.0", "0.0120".
std::string rounded(double number, int digits);
// As rounded(), without trailing zeros after the point: "44", "0.012".
std::string shortest(double number, int digits);

// Maps values to positions, in equal steps or in equal ratios.
struct Axis {
  bool isLogarithmic = false;
  double low = 0, high = 1;   // values at the ends; positive if logarithmic
  double first = 0, last = 1; // positions of `low` and `high`

  double position(double value) const;
};

// Axis whose range holds the finite values, those above 0 if it is logarithmic, with a margin around them.
Axis axisAround(std::span<const double> values, bool isLogarithmic, double first, double last);

// Round values within the range of the axis, in rising order: at most `most`, which is at least 2. A
// logarithmic axis has the finest series that fits: powers of ten times 1 to 9; times 1, 2, 5; times 1, 3;
// times 1; every n-th power. If that series has fewer than two ticks, ticks are in equal steps of 1, 2 or 5
// times a power.
std::vector<double> ticks(const Axis& axis, size_t most);

struct Place {
  double x = 0, y = 0;

  bool operator==(const Place&) const = default;
};

// Mark of the given kind around a place. Kinds repeat after kMarks: circle, square, triangle, diamond.
inline constexpr size_t kMarks = 4;
std::string mark(size_t kind, Place place, double radius, std::string_view classes);

// Open line through places; empty for fewer than two.
std::string line(std::span<const Place> places, std::string_view classes);

// Text at a place. `anchor` is start, middle or end.
std::string text(Place place, std::string_view anchor, std::string_view content, std::string_view classes);

struct Box {
  double x = 0, y = 0, width = 0, height = 0;
};
// Area that two boxes share.
double overlap(const Box& a, const Box& b);

// Boxes of labels of the given sizes near their places, inside `bounds`: each where it covers least of the
// labels before it, of the labelled places, and of `marks`. Of equally good boxes, the one nearest to its
// place counts.
std::vector<Box> placeLabels(std::span<const Place> labelled, std::span<const std::array<double, 2>> sizes,
                             std::span<const Place> marks, const Box& bounds);

} // namespace surflect::chart
