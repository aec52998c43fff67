#include "render/scene/script_warps.h"

#include <algorithm>

namespace surflect::scene {

namespace {

warp::Expression asFormula(const Entry& entry) {
  return at(entry, [&] { return warp::Expression(asText(entry), warp::warpVariables); });
}

std::array<int, 3> asThreeIntegers(const Entry& entry, std::string_view expected,
                                   const std::array<int, 3>& least, const std::array<int, 3>& most) {
  const std::vector<Entry> elements = asArray(entry, expected);
  if (elements.size() != 3) throw mismatch(entry, expected);
  return {asInteger(elements[0], least[0], most[0]), asInteger(elements[1], least[1], most[1]),
          asInteger(elements[2], least[2], most[2])};
}

warp::LatticeMotion asLattice(const Section& section) {
  constexpr int most = warp::mostLatticeDivisions;
  warp::LatticeMotion lattice{asPlace(section.require("min")), asPlace(section.require("max")), {}, {}};
  lattice.divisions =
      asThreeIntegers(section.require("divisions"), "three counts", {1, 1, 1}, {most, most, most});
  for (const Entry& entry : asArray(section.require("point"), "tables { at, move }")) {
    const Section point(entry, {"at", "move"});
    const Entry at = point.require("at");
    const auto index = asThreeIntegers(at, "three numbers of a control point", {0, 0, 0}, lattice.divisions);
    const auto same = [&](const warp::LatticeMotion::Point& other) { return other.index == index; };
    if (std::ranges::any_of(lattice.points, same)) throw mismatch(at, "each control point once");
    lattice.points.push_back({index, asTrack3(point.require("move"))});
  }
  return lattice;
}

warp::HandlesMotion asHandles(const Section& section) {
  std::vector<Vec3<double>> rest;
  warp::HandlesMotion motion;
  const Entry handles = section.require("handle");
  for (const Entry& entry : asArray(handles, "tables { rest, to }")) {
    const Section handle(entry, {"rest", "to"});
    const Entry place = handle.require("rest");
    const std::vector<Entry> xyz = asArray(place, "three numbers");
    if (xyz.size() != 3) throw mismatch(place, "three numbers");
    rest.emplace_back(Vec3<double>(asNumber(xyz[0]), asNumber(xyz[1]), asNumber(xyz[2])) - *place.origin);
    motion.targets.push_back(asPlace(handle.require("to")));
  }
  std::optional<double> radius;
  if (const auto entry = section.find("radius")) {
    radius = asNumber(*entry);
    if (!(*radius > 0)) throw mismatch(*entry, "more than 0");
  }
  motion.handles =
      at(handles, [&] { return std::make_shared<const warp::Handles>(std::move(rest), radius); });
  return motion;
}

warp::MeshMotion asMesh(const Section& section) {
  const Entry rest = section.require("rest");
  const auto frames = asPath(section.require("frames"));
  const auto frame = section.find("frame");
  return {std::make_shared<const warp::MeshSequence>(asPath(rest), frames, *rest.origin),
          frame ? asTrack(*frame) : warp::Track::expression("frame")};
}

warp::SkeletonMotion asSkeleton(const Section& section) {
  const auto animation = section.find("animation"), time = section.find("time");
  const Entry file = section.require("file");
  if (!file.origin->isZero(0))
    throw Error("glTF is single precision, too coarse for original coordinates: use a mesh or handles")
        .at(file.field);
  return {std::make_shared<const warp::Rig>(asPath(file), animation ? asText(*animation) : ""),
          time ? asTrack(*time) : warp::Track::expression("t")};
}

const std::vector<Kind<warp::WarpMotion>>& warpKinds() {
  static const std::vector<Kind<warp::WarpMotion>> kinds = {
      {"rigid",
       {"axis", "angle_deg", "center", "translate"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::RigidMotion{trackOr(s, "axis", warp::Track3{0, 1, 0}), placeOrOrigin(s, "center"),
                                  trackOr(s, "angle_deg", 0), trackOr(s, "translate", warp::Track3{0, 0, 0})};
       }},
      {"scale",
       {"factor", "center"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::ScaleMotion{asTrack3(s.require("factor")), placeOrOrigin(s, "center")};
       }},
      {"twist",
       {"axis", "center", "angle_deg", "length"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::TwistMotion{asTrack3(s.require("axis")), placeOrOrigin(s, "center"),
                                  asTrack(s.require("angle_deg")), trackOr(s, "length", 1)};
       }},
      {"bend",
       {"axis", "direction", "center", "angle_deg", "length"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::BendMotion{asTrack3(s.require("axis")), asTrack3(s.require("direction")),
                                 placeOrOrigin(s, "center"), asTrack(s.require("angle_deg")),
                                 trackOr(s, "length", 1)};
       }},
      {"taper",
       {"axis", "center", "factor", "length"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::TaperMotion{asTrack3(s.require("axis")), placeOrOrigin(s, "center"),
                                  asTrack(s.require("factor")), trackOr(s, "length", 1)};
       }},
      {"sine",
       {"axis", "direction", "center", "amplitude", "wavelength", "phase_deg"},
       [](const Section& s) -> warp::WarpMotion {
         return warp::SineMotion{asTrack3(s.require("axis")),      asTrack3(s.require("direction")),
                                 placeOrOrigin(s, "center"),       asTrack(s.require("amplitude")),
                                 asTrack(s.require("wavelength")), trackOr(s, "phase_deg", 0)};
       }},
      {"expression",
       {"x", "y", "z"},
       [](const Section& s) -> warp::WarpMotion {
         const Entry x = s.require("x");
         return warp::ExpressionMotion{asFormula(x), asFormula(s.require("y")), asFormula(s.require("z")),
                                       *x.origin};
       }},
      {"lattice",
       {"min", "max", "divisions", "point"},
       [](const Section& s) -> warp::WarpMotion { return asLattice(s); }},
      {"handles", {"handle", "radius"}, [](const Section& s) -> warp::WarpMotion { return asHandles(s); }},
      {"mesh", {"rest", "frames", "frame"}, [](const Section& s) -> warp::WarpMotion { return asMesh(s); }},
      {"skeleton",
       {"file", "animation", "time"},
       [](const Section& s) -> warp::WarpMotion { return asSkeleton(s); }},
  };
  return kinds;
}

} // namespace

std::vector<warp::WarpMotion> asWarps(const std::optional<Entry>& entry) {
  return asList(entry, warpKinds());
}

} // namespace surflect::scene
