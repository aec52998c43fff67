// What about a capture and its mesh cannot be right: the mistakes that captures come with, told from numbers
// and photographs. Each check looks for one kind and finds nothing in a capture that is as it should be.
#pragma once

#include "srf/capture/capture.h"
#include "srf/checks/small_view.h"
#include "srf/query/ray_caster.h"
#include "surfel/mesh.h"
#include "surfel/progress.h"

#include <limits>
#include <span>
#include <string>
#include <vector>

namespace surflect {

struct Finding {
  enum class Severity {
    warning, // some photographs will serve badly
    error    // the capture as a whole is not what it says
  };
  Severity severity;
  std::string text; // one sentence, without a full stop; names the worst cameras or lights
};

// How many photographs checks may read.
struct CheckEffort {
  size_t views = std::numeric_limits<size_t>::max(); // evenly chosen, for masks and exposures: one of each
  size_t litViews = 6;                               // evenly chosen, for lights
  size_t lightsOfView = std::numeric_limits<size_t>::max(); // evenly chosen
  bool everyLight = true; // for lights that those views do not have: one photograph more
  bool masks = true;      // not where the mesh is made of them
};
// Some dozens of photographs whatever the capture: what pack can afford.
inline constexpr CheckEffort kQuickChecks{12, 2, 12, false, true};

// Without a mesh: most cameras look away from where their axes meet, as where axes or matrices are others
// than stated; cameras thirty times farther away than most, of three views or more whose axes do meet. All
// cameras at one place. A scene so far from 0 that float positions are off by more than a tenth of a pixel.
std::vector<Finding> checkPoses(const Capture& capture);

// Masks without object or with black and white exchanged, and views without a mask beside those with one: the
// warnings of srf/capture/mask_survey.h. Reads all masks.
std::vector<Finding> checkMattes(const Capture& capture, const Progress& progress);

// Cameras that have none of the mesh in their picture.
std::vector<Finding> checkCameras(const Capture& capture, const TriangleMesh& mesh);

// Units that differ: cameras inside the mesh's box, or the mesh a speck in all pictures; point lights inside
// the box, or a thousand times as far away as the mesh is large.
std::vector<Finding> checkUnits(const Capture& capture, const TriangleMesh& mesh);

// Views whose masks and silhouettes of the mesh differ by more than a rim: pixels at least two steps inside
// of one and outside of the other, more than 2 % of the silhouette. Views without alpha or mask are passed
// over.
std::vector<Finding> checkMasks(const Capture& capture, std::span<const SmallView> views);

// Whether the mesh lies where photographs without masks show it: by how much steeper they are at its outline
// than beside it. Where that is little, because it lies elsewhere or before a wild background, views are
// asked whether they agree about the brightness of its points, under fixed light: an error where they do not.
std::vector<Finding> checkPlacement(std::span<const SmallView> views, const TriangleMesh& mesh,
                                    const RayCaster<AcquisitionSpace>& caster, const Progress& progress);

// Photographs that are black (under fixed light), or at the largest value of their format in more than half
// of the object.
std::vector<Finding> checkExposures(const Capture& capture, std::span<const SmallView> views);

// Whether photographs are brighter where the mesh faces the light, by the correlation over pixels between
// max(0, n . l) and luminance, divided by what a pixel's other photographs tell of its albedo (where a view
// has eight lights or more). Four kinds of findings: faces point inwards; all directions fit much better with
// axes negated or exchanged; photographs of one light look lit by another; they do not follow the direction
// of theirs. The last two need albedo. Lights that leave the visible side dark tell nothing, and so does
// fixed illumination; cast shadows are not expected. Reads the photographs of up to six views, and one of
// every light that these do not have; progress names the stage "lights".
std::vector<Finding> checkLights(const Capture& capture, const TriangleMesh& mesh,
                                 const RayCaster<AcquisitionSpace>& caster, const CheckEffort& effort,
                                 const Progress& progress);

// All of the above but the first two; where cameras or units are wrong altogether, these alone.
std::vector<Finding> checkCapture(const Capture& capture, const TriangleMesh& mesh, const CheckEffort& effort,
                                  const Progress& progress);

} // namespace surflect
