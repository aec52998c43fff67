// Finds common mistakes in a capture and its mesh, from its numbers and photographs. Each check looks for one
// kind, and finds nothing in a correct capture. Captures have the lights alone that their frames name, as
// capture::subset() leaves them: none under fixed light.
#pragma once

#include "srf/capture/capture.h"
#include "srf/proxy/impostor.h"
#include "srf/validation/small_view.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"

#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::validation {

struct Finding {
  enum class Severity {
    warning, // some photographs are of little use
    error    // the capture as a whole is wrong
  };
  Severity severity;
  std::string text; // one sentence without a full stop, naming the worst cameras or lights
};

// Limits on the photographs that checks read; views, lights and masks are chosen evenly.
struct CheckEffort {
  // Maximum number of views, with one photograph each, for masks, placement and exposure.
  size_t views = std::numeric_limits<size_t>::max();
  size_t litViews = 6;                                      // maximum number of views for the lights
  size_t lightsOfView = std::numeric_limits<size_t>::max(); // maximum number of photographs per lit view
  bool everyLight = true;                                   // one more photograph for each light not yet read
  bool masks = true; // compare masks with the mesh; false if the mesh was carved from them
};
// Least number of lights of a view that determine a pixel's albedo; views with fewer do not tell whether the
// lights are right.
inline constexpr size_t kLightsForAlbedo = 8;
// Effort of `pack`: some dozens of photographs for any capture.
inline constexpr CheckEffort kQuickChecks{12, 2, 12, false, true};

// Poses, without a mesh. Findings: most cameras look away from the point where their axes meet, as with wrong
// axes or matrix conventions; a camera is thirty times farther away than most (for three or more views whose
// axes meet); all cameras are at one place; all lights stand in one direction; the scene is so far from 0
// that float positions are off by more than a tenth of a pixel.
std::vector<Finding> checkPoses(const capture::Capture& capture);

// Masks without object, inverted masks, and views without a mask beside views with one: the warnings of
// srf/capture/mask_file.h. Reads at most `effort.views` masks.
std::vector<Finding> checkMattes(const capture::Capture& capture, const CheckEffort& effort,
                                 const Progress& progress);

// Float positions at the middle of the scene are off by more than a tenth of a pixel.
std::optional<Finding> checkPrecision(const capture::Capture& capture,
                                      const Point3<AcquisitionSpace, double>& middle);

// Cameras that do not see the mesh.
std::vector<Finding> checkCameras(const capture::Capture& capture, const TriangleMesh& mesh);

// Wrong units: cameras inside the mesh's box, or the mesh a speck in all pictures; point lights inside the
// box, or a thousand times as far away as the mesh is large.
std::vector<Finding> checkUnits(const capture::Capture& capture, const TriangleMesh& mesh);

// Measurements of a small view.
struct ViewMeasures {
  // Pixels at least two steps inside of silhouette or mask and outside of the other, relative to the
  // silhouette.
  struct MaskDifference {
    double surplus = 0,
           missing = 0; // share of the silhouette outside the mask; share of the mask outside the silhouette
  };
  size_t view = 0;                    // index into Capture::views
  std::optional<MaskDifference> mask; // for views with a matte
  // For views without a matte: image gradient at the silhouette's outline over the gradient some steps beside
  // it; none without an outline, or for an even picture.
  std::optional<double> outlineContrast;
  double brightest = 0; // maximum over the object
  double clipped = 0;   // share of the object at the largest value of the picture's format
  bool isBlack = false; // the whole picture is black
  bool isThin = false;  // no pixel of the object has all four neighbours, in a picture that was not reduced
};
ViewMeasures measure(const capture::Capture& capture, const SmallView& view);

// Views whose masks differ from the mesh's silhouettes by more than a rim: more than 2 % of the silhouette.
std::vector<Finding> checkMasks(const capture::Capture& capture, std::span<const ViewMeasures> views);

// Median over the views that have one. Below 1.5 the photographs are flat at the mesh's outline: the mesh
// lies elsewhere, or the background is cluttered.
std::optional<double> outlineContrast(std::span<const ViewMeasures> views);

// Placement of the mesh under fixed light. If the contrast at its outline is small, `views` are compared in
// the brightness of the mesh's points: an error if they disagree. Cost: each view is compared with its eight
// nearest.
std::vector<Finding> checkPlacement(double outlineContrast, std::span<const SmallView> views,
                                    const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& caster,
                                    const Progress& progress);

// Objects that are thinner than three pixels in all views: the weights of a surfel are those of its
// surroundings.
std::vector<Finding> checkThinness(std::span<const ViewMeasures> views);

// Photographs that are black (under fixed light, or all of them), or at the largest value of their format in
// more than half of the object.
std::vector<Finding> checkExposures(const capture::Capture& capture, std::span<const ViewMeasures> views);

// Light directions, by the correlation over pixels between max(0, n . l) and luminance, divided by the albedo
// estimated from the pixel's other photographs (for views with eight lights or more). Of a single view,
// pixels that are dark in all photographs, as background is, do not count. Findings: faces point inwards; all
// directions fit much better with axes negated or, if that explains less, exchanged; the table of lights is
// shifted, reversed or sorted otherwise; positions are in other units; two lights are exchanged; photographs
// of one light look lit by another, or do not follow their light's direction. All but the first two need
// albedo; the order and single lights are not checked above 512 lights. Lights that leave the visible side
// dark, and fixed illumination, give no finding; cast shadows are not modelled. If shading does not follow
// the lights and the contrast at the outline is flat, the mesh lies elsewhere: an error. Reads the
// photographs that `effort` allows; progress names the stage "lights".
std::vector<Finding> checkLights(const capture::Capture& capture, const TriangleMesh& mesh,
                                 const RayCaster<AcquisitionSpace>& caster, const CheckEffort& effort,
                                 std::optional<double> outlineContrast, const Progress& progress);

// Light directions of a single view, by normals from the photographs alone, which need no geometry:
// directions that are negated in z, or in x, y and z, make most of what the camera sees turn away from it, an
// error; in x and y, the object turn inwards at its matte's outline. A table of seven lights or more whose
// order is another is told by the residual of the normals. `middle` is the object's. No finding for
// several views, fewer than three lights, lights that do not determine normals, and without enough pixels of
// the object: without a matte, those above a tenth of the brightest.
std::vector<Finding> checkLightsOfOneView(const capture::Capture& capture,
                                          const Point3<AcquisitionSpace, double>& middle,
                                          const CheckEffort& effort, const Progress& progress);

// Runs checkCameras to checkLightsOfOneView, and none after an error of checkCameras or checkUnits. Runs
// checkPrecision at the mesh if checkPoses() finds no middle of the scene.
std::vector<Finding> checkCapture(const capture::Capture& capture, const TriangleMesh& mesh,
                                  const CheckEffort& effort, const Progress& progress);

// Takes the findings of one kind of check; throws Error where they stop the work.
using TakeFindings = std::function<void(std::span<const Finding>)>;
// Throws the first error among the findings.
void requireNoError(std::span<const Finding> findings);

// Checks that the builders of all methods run on the training frames of a capture: poses and mattes before
// its geometry is made, and then the geometry, against what it was not made from. Throws Error and Cancelled
// as the checks above and `take` do.
void checkBeforeGeometry(const capture::Capture& training, const CheckEffort& effort,
                         const TakeFindings& take, const Progress& progress);
void checkGeometry(const capture::Capture& training, const proxy::Impostor& impostor, CheckEffort effort,
                   const TakeFindings& take, const Progress& progress);

} // namespace surflect::validation
