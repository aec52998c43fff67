// Checks of the contract: a figure measured on a user's model or frame, the bound that it must keep, and what
// to do where it does not. All rules stand in one table.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/math/space.h"

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::verify {

// Rule of a check.
struct Rule {
  std::string_view name; // key in reports and of --bound
  bool isOfFrame;        // true: of a frame of a script; false: of the model
  std::string_view claim;
  std::string_view unit;       // of the figure; may be empty
  std::optional<double> bound; // default; none: the figure is stated, not judged
  bool isLeast;                // true: the bound is the least allowed figure; false: the largest
  std::string_view advice;     // where the bound is broken
};

// Bounds that replace the defaults, by name.
using Bounds = std::map<std::string, double>;
// Throws Error unless every name is that of a rule and every bound is a number.
void requireBounds(const Bounds& bounds);

enum class Verdict { kept, broken, stated, inapplicable };
std::string_view nameOf(Verdict verdict);

// Surfel with the worst figure of a check, or one of the surfels that break the check.
struct FlaggedPlace {
  uint32_t surfel = 0;
  Vec3<double> rest = {0, 0, 0};            // place at rest, in the model's coordinates
  std::optional<capture::Pixel> pixel = {}; // in the frame, if it lies there
  double figure = 0;                        // of this surfel
};

struct Check {
  const Rule* rule; // never null
  Verdict verdict = Verdict::stated;
  double figure = 0;
  std::optional<double> bound = {};
  std::string finding; // one sentence; for an inapplicable check, why it is
  std::vector<FlaggedPlace> places = {};
};

// Check of the rule with this name, which must exist. A figure that is not a number breaks every bound.
Check judged(std::string_view rule, double figure, const Bounds& bounds, std::string finding,
             std::vector<FlaggedPlace> places = {});
Check inapplicable(std::string_view rule, std::string why);

// Number of checks whose bound is broken.
size_t countBroken(std::span<const Check> checks);

// Figure with its unit, for readers.
std::string figureText(const Rule& rule, double figure);

} // namespace surflect::verify
