#include "render/script_warps.h"

namespace surflect {

namespace {

const Track3 origin{0, 0, 0}, yUp{0, 1, 0};

Expression asFormula(const Entry& entry) {
  return at(entry, [&] { return Expression(asText(entry), warpVariables); });
}

const std::vector<Kind<WarpMotion>>& warpKinds() {
  static const std::vector<Kind<WarpMotion>> kinds = {
      {"rigid",
       {"axis", "angle_deg", "center", "translate"},
       [](const Section& s) -> WarpMotion {
         return RigidMotion{trackOr(s, "axis", yUp), trackOr(s, "center", origin), trackOr(s, "angle_deg", 0),
                            trackOr(s, "translate", origin)};
       }},
      {"scale",
       {"factor", "center"},
       [](const Section& s) -> WarpMotion {
         return ScaleMotion{asTrack3(s.require("factor")), trackOr(s, "center", origin)};
       }},
      {"twist",
       {"axis", "center", "angle_deg", "length"},
       [](const Section& s) -> WarpMotion {
         return TwistMotion{asTrack3(s.require("axis")), trackOr(s, "center", origin),
                            asTrack(s.require("angle_deg")), trackOr(s, "length", 1)};
       }},
      {"bend",
       {"axis", "direction", "center", "angle_deg", "length"},
       [](const Section& s) -> WarpMotion {
         return BendMotion{asTrack3(s.require("axis")), asTrack3(s.require("direction")),
                           trackOr(s, "center", origin), asTrack(s.require("angle_deg")),
                           trackOr(s, "length", 1)};
       }},
      {"sine",
       {"axis", "direction", "center", "amplitude", "wavelength", "phase_deg"},
       [](const Section& s) -> WarpMotion {
         return SineMotion{asTrack3(s.require("axis")),      asTrack3(s.require("direction")),
                           trackOr(s, "center", origin),     asTrack(s.require("amplitude")),
                           asTrack(s.require("wavelength")), trackOr(s, "phase_deg", 0)};
       }},
      {"expression",
       {"x", "y", "z"},
       [](const Section& s) -> WarpMotion {
         return ExpressionMotion{asFormula(s.require("x")), asFormula(s.require("y")),
                                 asFormula(s.require("z"))};
       }},
  };
  return kinds;
}

} // namespace

std::vector<WarpMotion> asWarps(const std::optional<Entry>& entry) { return asList(entry, warpKinds()); }

} // namespace surflect
