// Views under other light, as the exact sum of each view's photographs under single lights (OLAT): a capture
// under fixed light of any reflectance-field capture. [Weyrich 2005, Fig. 2]
#pragma once

#include "render/scene/scene.h"
#include "srf/capture/capture.h"
#include "surfel/base/progress.h"
#include "surfel/math/rgb.h"

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace surflect::lightfield {

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
