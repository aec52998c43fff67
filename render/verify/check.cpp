#include "render/verify/check.h"

#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace surflect::verify {

namespace {

constexpr std::array kRules = {
    Rule{"look_up", false, "the look-up L keeps lengths and angles, and undoes rotations and mirrors", "",
         1e-6, false, "Tangent frames of the model are damaged: pack it again."},
    Rule{"weights", false, "weights of photographs sum to 1", "", 1e-5, false,
         "This is a fault of the program or of fades.bin: pack the model again, and report it if it stays."},
    Rule{"met_view", false, "a captured camera that is met has all the weight", "", 0.05, false,
         "Photographs do not come back at their own cameras: compare --interpolation paper."},
    Rule{"blocks_damaged", false, "every stored block can be read", "blocks", 0, false,
         "Copy the model again, or pack it again."},
    Rule{"block_error", false, "every stored block keeps the error that pack allowed it", "of the bound",
         1.001, false,
         "The capture is another than the one that was packed, or has changed since: pack it again."},
    Rule{"coverage", false, "a camera sees every surfel", "% of the surface", 1, false,
         "Photograph the places from where they are in sight; fallback views show them until then. Places "
         "that no "
         "script shows do no harm: raise the bound."},
    Rule{"unlit", false, "surface that no captured light reaches", "% of the surface", std::nullopt, false,
         ""},
    Rule{"view_gap", false, "largest angle from a direction that faces the surface to a camera that sees it",
         "deg", std::nullopt, false, ""},
    Rule{"light_gap", false, "largest angle from a direction that faces the surface to a captured light",
         "deg", std::nullopt, false, ""},
    Rule{"precision", false, "coordinates are precise enough for the distance of surfels", "% of it", 1,
         false, "Import the capture again, which moves its origin to the object, or scale it."},
    Rule{"exact_surfels", false, "surfels show their own photographs at captured cameras and lights",
         "% of white", 1, false,
         "Compare --interpolation paper and separate; more --pairs do not help here."},
    Rule{"exact_pictures", false, "pictures equal their own photographs at captured cameras and lights", "dB",
         30, true,
         "If the figure inside of the outlines is much better, geometry and mattes differ: see `inspect "
         "--overlay`. If "
         "the worst photographs share a camera, check its pose, if a light, its direction. If all are alike, "
         "the "
         "pictures have more detail than the surfels: pack with more --surfels."},
    Rule{"collapsed", true, "the warp gives every surfel a place and an area", "% of the surfels", 0, false,
         "The warp flattens or tears the marked places, which are not drawn: weaken it there."},
    Rule{"folded", true, "the warp does not turn parts of the surface inside out", "% of the surfels", 0,
         false, "The warp folds over at the marked places: bend or push less, or over a longer distance."},
    Rule{"stretch", true, "splats stay rounder than this ratio of their axes", ": 1", 10, false,
         "Texture smears and the look-up depends on small errors of the warp: spread the stretch."},
    Rule{"unseen", true, "visible surfels are answered by views that see them", "% of those visible", 1,
         false, "Photograph these places, or turn the camera of the script away from them."},
    Rule{"views_extrapolated", true, "a captured camera is near each requested view", "% of those visible",
         25, false,
         "Add cameras there, or bend and orbit less: highlights stay where the nearest camera saw them."},
    Rule{"lights_extrapolated", true, "a captured light is near each requested light", "% of those lit", 25,
         false,
         "Add captured lights there, or move the light of the script; `uncovered = \"fade\"` darkens it "
         "instead."},
    Rule{"shadows_unmatched", true, "photographs have the requested shadow state", "% of surfels and lights",
         5, false,
         "Few photographs show these places in light, or in shadow: add lights, or compare --shadows off."},
    Rule{"shared", true, "surfels of whose light from lamps tables answer more than half",
         "% of those visible", std::nullopt, false, ""},
    Rule{"frame_weights", true, "weights of photographs sum to 1", "", 1e-5, false,
         "This is a fault of the program: please report it with the script."},
    Rule{"frame_look_up", true, "directions come back by L as in double precision", "", 1e-6, false,
         "The object is very far from the origin or the warp is nearly flat: see precision and stretch."},
    Rule{"finite", true, "every pixel is a finite number", "pixels", 0, false,
         "This is a fault of the program: please report it with the script."},
    Rule{"frame_precision", true, "places of splats are precise on the screen", "pixels", 0.1, false,
         "The warp moves the object far from the origin: move the camera instead."},
};

const Rule& ruleOf(std::string_view name) {
  const auto found = std::ranges::find(kRules, name, &Rule::name);
  assert(found != kRules.end());
  return *found;
}

} // namespace

void requireBounds(const Bounds& bounds) {
  std::vector<std::string_view> names;
  for (const Rule& rule : kRules)
    if (rule.bound) names.push_back(rule.name);
  for (const auto& [name, bound] : bounds) {
    if (std::ranges::find(names, name) == names.end()) {
      throw Error::mismatch(fmt::format("one of {}{}", fmt::join(names, ", "), didYouMean(name, names)),
                            "'" + name + "'")
          .at("--bound");
    }
    if (!std::isfinite(bound)) throw Error::mismatch("a number", numberText(bound)).at(name).at("--bound");
  }
}

std::string_view nameOf(Verdict verdict) {
  constexpr std::array<std::string_view, 4> kNames{"kept", "broken", "stated", "inapplicable"};
  return kNames[static_cast<size_t>(verdict)];
}

Check judged(std::string_view name, double figure, const Bounds& bounds, std::string finding,
             std::vector<FlaggedPlace> places) {
  const Rule& rule = ruleOf(name);
  Check check{&rule, Verdict::stated, figure, rule.bound, std::move(finding), std::move(places)};
  if (!rule.bound) return check;
  if (const auto given = bounds.find(std::string(name)); given != bounds.end()) check.bound = given->second;
  const bool isKept = rule.isLeast ? figure >= *check.bound : figure <= *check.bound;
  check.verdict = isKept ? Verdict::kept : Verdict::broken;
  return check;
}

Check inapplicable(std::string_view name, std::string why) {
  return {&ruleOf(name), Verdict::inapplicable, 0, std::nullopt, std::move(why), {}};
}

size_t countBroken(std::span<const Check> checks) {
  return static_cast<size_t>(std::ranges::count(checks, Verdict::broken, &Check::verdict));
}

std::string figureText(const Rule& rule, double figure) {
  const std::string number =
      std::abs(figure) >= 0.01 || figure == 0 ? fmt::format("{:.4g}", figure) : fmt::format("{:.1e}", figure);
  return rule.unit.empty() ? number : fmt::format("{} {}", number, rule.unit);
}

} // namespace surflect::verify
