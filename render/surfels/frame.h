// One frame: a deformed cloud, splatted for a camera and shaded.
//
//   deform -> splat -> queries -> shade -> develop
//
// The pixels of a model with a pixel grid are drawn without splats (pixel_frame.h).
#pragma once

#include "render/method/renderer.h"
#include "render/scene/scene.h"
#include "render/splat/splat_raster.h"
#include "render/surfels/cut.h"
#include "render/surfels/ground_shadow.h"
#include "render/surfels/kept_stages.h"
#include "render/surfels/predicted_error.h"
#include "render/surfels/prepared_environment.h"
#include "srf/shading/shade.h"
#include "surfel/cloud.h"
#include "surfel/level_of_detail.h"
#include "surfel/occluders.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace surflect::surfels {

// The splats of a cloud that a camera sees.
splat::SplatRaster look(const capture::Camera<ObjectSpace>& camera, const SurfelCloud& rest,
                        const DeformedCloud& deformed, const splat::SplatOptions& options = {},
                        const Progress& progress = {});

using method::FrameLayers;

struct FrameStats {
  splat::SplatCounts splats;
  size_t cloud = 0;   // surfels of the model
  size_t surfels = 0; // warped and projected
  size_t visible = 0, unseen = 0;
  size_t unmatchedShadows = 0; // as in Shaded
  size_t covered = 0;          // pixels in blocks of 4 x 4 that splats may reach
  size_t queries = 0;          // fewer than visible surfels where patches share weights
  // Lights per query: those of the scene, and those that stand for its environments. Lights of an environment
  // with a light table, which cost less, count as tabulated.
  size_t lights = 0, tabulatedLights = 0;
  size_t pairLights = 0; // directional, point and key lights whose photographs are weighted by pairs
  size_t occluders = 0;  // splats that cast shadows
  size_t environments = 0;
  shading::ShadingStats shading;
  // Stages: "warp", "shadows" if they are used, "splat", "queries", "ulr" (of cameras and lights), "look-up",
  // "develop", "aov" if AOVs are requested, and "ground" if the scene has one.
  std::map<std::string, double> seconds;          // per stage
  std::map<std::string, double> processorSeconds; // per stage, of all threads of the process
};

// Orthonormal tangents (u-bar, v-bar) of a warped surfel, which L is made of.
enum class Tangents {
  polar,    // nearest to (u, v): polarFrame
  bisector, // [Weyrich 2005, Eqs. 8 and 9]: bisectorFrame
  along,    // the line along the fibre of the model's tables follows the warp: withCarriedLines
  across    // the line across that fibre does
};

// Deformed surfels with the tangents of an option, for L alone; an empty cloud for polar ones, which need no
// copy. drawn: numbers of these surfels in the field; all of its surfels if empty. Other than polar and
// bisector need a field with tables. Throws Cancelled.
DeformedCloud withTangents(Tangents tangents, const DeformedCloud& deformed,
                           const weights::ReflectanceField& field, std::span<const uint32_t> drawn = {},
                           const Progress& progress = {});

// Default of FrameOptions::surfelsPerQuery where corners may be blended.
size_t surfelsPerCorner(const weights::ReflectanceField& field, const weights::ShadeOptions& options);

struct FrameOptions {
  weights::ShadeOptions shade;
  splat::SplatOptions splats;
  // Overrides whether shadows are found by rays where photographs are weighted by pairs; see CastShadows and
  // InterpolationChoice.
  std::optional<bool> shadows = {};
  Tangents tangents = Tangents::polar;
  // Pixels between neighbouring surfels; see Cut. 0: all surfels are drawn.
  double surfelSize = 0;
  // One query of weights is made for about so many surfels: those of a patch share the weights of its middle.
  // Under kriging and tables, of opaque objects and without environments, the surfels of a patch four times
  // as large blend the weights of its four corners (patch_corners.h). Default: surfelsPerCorner, else 1.
  std::optional<size_t> surfelsPerQuery = {};
  double environmentError = 0; // least error of environments (prepared_environment.h)
  std::vector<std::string> aovs;
  std::optional<ErrorModel> errorModel = {}; // of the AOV predicted_error; none: the fitted one
};

// Blocks, environments and memory that one frame passes on to the next, and the stages that it may take over.
// Owned by the caller; one frame uses it at a time.
struct FrameWorkspace {
  // Keeps up to cacheBytes of decoded blocks. The field must outlive the workspace.
  FrameWorkspace(const weights::ReflectanceField& field, size_t cacheBytes)
      : cache(field.files, cacheBytes) {}

  codec::BlockCache cache;
  EnvironmentCache environments;
  DeformedCloud deformed;
  splat::SplatRaster raster;
  std::optional<Occluders> occluders; // found by the first frame that needs them
  std::optional<Occluders> finer;     // those of the ground: at most kMostGroundOccluders
  GroundEnvironments groundLights;
  std::vector<uint64_t>
      present; // texels of each block of a model with a pixel grid; 0 until a frame needs the block
  std::optional<CutLevels> levels; // built by the first frame that needs them
  Cut cut;
  Patches patches;            // of at most surfelsPerPatch surfels
  size_t surfelsPerPatch = 1; // no patches are needed for 1
  FrameLayers layers;         // memory for the next frame: a caller that is done with a frame may put it here
  FrameStats stats;           // of the last frame, or question for its photographs
  // Frames take over stages of the last one where they would come out the same (kept_stages.h). Their bits
  // do not change. `stats` then counts queries and look-ups that were done, but splats and occluders as for a
  // whole frame.
  bool keepsStages = false;
  KeptStages kept;
};

// Throws Error as shade does, and Cancelled.
FrameLayers renderFrame(const weights::ReflectanceField& field, const scene::Scene& scene,
                        const FrameOptions& options, FrameWorkspace& workspace,
                        const Progress& progress = {});

// Photographs blended at the surfel of the largest weight at a pixel of the frame, each by the share of its
// weight, for all lights together, in the sum over all. A surfel that shares the weights of a patch is asked
// for its own. Needs no AOVs. Throws Error and Cancelled as renderFrame.
method::PhotographBlend blendedAt(const weights::ReflectanceField& field, const scene::Scene& scene,
                                  capture::Pixel pixel, const FrameOptions& options,
                                  FrameWorkspace& workspace, const Progress& progress = {});

} // namespace surflect::surfels
