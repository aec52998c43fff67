// Relights a capture: turns the photographs of each view under single lights (OLAT) into one picture under
// other light, as their weighted sum. The result is a capture under fixed light.  [Weyrich 2005, Fig. 2]
#pragma once

#include "render/scene/scene.h"
#include "srf/capture/capture.h"
#include "srf/capture/photograph.h"
#include "srf/capture/rig.h"
#include "surfel/base/time.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace surflect::lightfield {

// Weights of a view's photographs under single lights (OLAT), with which their sum is its photograph under
// other light.
//
// Radiance is linear in light: L = sum_l w_l L_l, with w_l = E_l / C_l per channel.
//   L_l  photograph under captured light l         C_l  irradiance of captured light l at the object's middle
//   E_l  irradiance, of the new light, that is assigned to captured light l
//
// [Weyrich 2005, Fig. 2] assigns each texel of an environment to its nearest captured light. A directional or
// point light is shared by the nearest captured lights with the weights of unstructured lumigraph rendering
// (srf/weights/ulr.h) for its direction from the object's middle.

// Index of the captured light nearest to a direction; the first of equally near ones. Directions are unit,
// and there is at least one light.
size_t nearestLight(std::span<const Direction3<AcquisitionSpace, double>> lights,
                    const Direction3<AcquisitionSpace, double>& towards);

// Weights of the photographs under captured lights (#captured, at least one) for the sum of the lights of a
// shot. The shot's object space is the acquisition space, as nothing is warped. A direction within 1e-5
// radians of a captured light is that light: all other weights are 0. Throws Error for a weight that is not
// finite, as of a light at the object's middle, and Cancelled.
std::vector<Rgb> photographWeights(std::span<const capture::Light> captured,
                                   const Point3<AcquisitionSpace, double>& middle,
                                   std::span<const scene::ShotLight> lights, const Progress& progress = {});

// Sum of photographs of one view, each multiplied by its weight (#photographs, at least one); in double
// precision, so that a single photograph becomes exactly its product. Alpha is the maximum over the
// photographs; colours are summed premultiplied, as a photograph shows nothing where its own alpha is 0.
capture::Photograph weightedSum(std::span<const capture::Photograph> photographs,
                                std::span<const Rgb> weights);

// Lights and views that take part, where some photographs are missing.
enum class Incomplete {
  refused, // an Error: every view needs a photograph under every light whose weight is not 0
  skipped, // views that lack such a photograph are left out
  common   // only lights under which every view has a photograph take part
};

struct RelightPlan {
  std::vector<capture::Light> lights;           // that take part
  std::vector<Rgb> weights;                     // of their photographs (#lights), not all channels 0
  std::vector<std::vector<size_t>> photographs; // per view of `views`: a frame of the capture for each light
  capture::Capture views;                       // the result: one frame per view, without lights
  std::vector<std::string> skipped;             // names of views that are left out
};

// Plans the views of a capture under the lights of a shot. photographWeights() gives the weights, at the
// middle of the mesh's box or, without a mesh, at the point that the cameras look at. Only lights of training
// frames take part. A view whose sum has a held-out photograph is held out. Throws Error for a capture
// without lights, if all weights are 0 and, naming view and light, for a missing photograph; also as
// photographWeights() does, and Cancelled.
RelightPlan planRelight(const capture::Capture& capture, std::span<const scene::ShotLight> lights,
                        Incomplete incomplete, const Progress& progress = {});

struct RelightReport {
  size_t resumedViews = 0;
  size_t invalidTexels = 0; // NaN or infinite in photographs read by this run; now black
};

// Writes the planned views of a capture: one EXR per view, the mesh and, last, transforms.json. Pictures have
// half floats; single floats where a photograph has, or where values exceed the range of half floats. The
// same call resumes an interrupted run. Throws Error, also if the folder holds anything but an unfinished or
// finished run with the same plan and files, and Cancelled. Memory: the photographs of one view, 16 bytes per
// pixel and light, and as much again while they are read.
RelightReport relight(const capture::Capture& capture, const RelightPlan& plan,
                      const std::filesystem::path& folder, const Progress& progress = {});

} // namespace surflect::lightfield
