// What about a capture and its mesh cannot be right: the mistakes that captures come with, told from numbers
// and photographs. Each check looks for one kind and finds nothing in a capture that is as it should be.
#pragma once

#include "srf/capture/capture.h"
#include "srf/validation/small_view.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::validation {

struct Finding {
  enum class Severity {
    warning, // some photographs will serve badly
    error    // the capture as a whole is not what it says
  };
  Severity severity;
  std::string text; // one sentence, without a full stop; names the worst cameras or lights
};

// How many photographs checks may read; views, lights and masks are evenly chosen.
struct CheckEffort {
  // At most this many views, one photograph each: masks, placement, exposure.
  size_t views = std::numeric_limits<size_t>::max();
  size_t litViews = 6;                                      // at most this many, for lights
  size_t lightsOfView = std::numeric_limits<size_t>::max(); // at most this many photographs of each lit view
  bool everyLight = true; // one more photograph for each light not met so far
  bool masks = true;      // compare masks with the mesh; off where the mesh was made from them
};
// Effort of pack: some dozens of photographs whatever the capture.
inline constexpr CheckEffort kQuickChecks{12, 2, 12, false, true};

// Without a mesh: most cameras look away from where their axes meet, as where axes or matrices are others
// than stated; cameras thirty times farther away than most, of three views or more whose axes do meet. All
// cameras at one place. A scene so far from 0 that float positions are off by more than a tenth of a pixel.
std::vector<Finding> checkPoses(const capture::Capture& capture);

// Masks without object or with black and white exchanged, and views without a mask beside those with one: the
// warnings of srf/capture/mask_survey.h. Reads at most `effort.views` masks.
std::vector<Finding> checkMattes(const capture::Capture& capture, const CheckEffort& effort,
                                 const Progress& progress);

// A middle of the scene where float positions are off by more than a tenth of a pixel.
std::optional<Finding> checkPrecision(const capture::Capture& capture,
                                      const Point3<AcquisitionSpace, double>& middle);

// Cameras that have none of the mesh in their picture.
std::vector<Finding> checkCameras(const capture::Capture& capture, const TriangleMesh& mesh);

// Units that differ: cameras inside the mesh's box, or the mesh a speck in all pictures; point lights inside
// the box, or a thousand times as far away as the mesh is large.
std::vector<Finding> checkUnits(const capture::Capture& capture, const TriangleMesh& mesh);

// Numbers that stand for a small view.
struct ViewMeasures {
  // Pixels at least two steps inside of silhouette or mask and outside of the other, over the silhouette.
  struct MaskDifference {
    double surplus = 0, missing = 0; // of the silhouette outside the mask; of the mask beyond it
  };
  size_t view = 0;                    // index into the capture's
  std::optional<MaskDifference> mask; // of views with a matte
  // In views without a matte: how many times as steep the photograph is at the silhouette's outline as some
  // steps off it; none where there is no outline, or the picture is even.
  std::optional<double> outlineContrast;
  double brightest = 0; // of the object
  double clipped = 0;   // share of the object at the largest value of the picture's format
  bool isBlack = false; // all of the picture
};
ViewMeasures measure(const capture::Capture& capture, const SmallView& view);

// Views whose masks and silhouettes of the mesh differ by more than a rim: more than 2 % of the silhouette.
std::vector<Finding> checkMasks(const capture::Capture& capture, std::span<const ViewMeasures> views);

// Median over the views that have it. Below 1.5 photographs are flat where the mesh has its outline, because
// it lies elsewhere, or before a wild background.
std::optional<double> outlineContrast(std::span<const ViewMeasures> views);

// Whether the mesh lies where photographs show it, under fixed light. Where the contrast at its outline is
// little, `views` are asked whether they agree about the brightness of its points: an error where they do
// not. Cost: each view is compared with its eight nearest.
std::vector<Finding> checkPlacement(double outlineContrast, std::span<const SmallView> views,
                                    const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& caster,
                                    const Progress& progress);

// Photographs that are black (under fixed light, or all), or at the largest value of their format in more
// than half of the object.
std::vector<Finding> checkExposures(const capture::Capture& capture, std::span<const ViewMeasures> views);

// Whether photographs are brighter where the mesh faces the light, by the correlation over pixels between
// max(0, n . l) and luminance, divided by what a pixel's other photographs tell of its albedo (where a view
// has eight lights or more). Four kinds of findings: faces point inwards; all directions fit much better with
// axes negated or exchanged; photographs of one light look lit by another; they do not follow the direction
// of theirs. The last two need albedo. Lights that leave the visible side dark tell nothing, and so does
// fixed illumination; cast shadows are not expected. Where shading does not follow the lights and
// the contrast at the outline is flat, the mesh lies elsewhere: an error. Reads the photographs that `effort`
// allows; progress names the stage "lights".
std::vector<Finding> checkLights(const capture::Capture& capture, const TriangleMesh& mesh,
                                 const RayCaster<AcquisitionSpace>& caster, const CheckEffort& effort,
                                 std::optional<double> outlineContrast, const Progress& progress);

// checkCameras to checkLights; after an error of checkCameras or checkUnits, no others. And checkPrecision at
// the mesh, where checkPoses() finds no middle of the scene.
std::vector<Finding> checkCapture(const capture::Capture& capture, const TriangleMesh& mesh,
                                  const CheckEffort& effort, const Progress& progress);

} // namespace surflect::validation
