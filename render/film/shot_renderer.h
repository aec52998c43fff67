// A script and its model, ready to render any frame of the shot.
#pragma once

#include "render/surfels/frame.h"

#include <optional>
#include <utility>
#include <vector>

namespace surflect::film {

class ShotRenderer {
public:
  // Prepares the script's environments. The script is one that requireShot accepts, options.aovs do not
  // matter; script, model and progress must stay. Throws Error as prepareEnvironments does.
  ShotRenderer(const scene::Script& script, const model::Model& model, const surfels::FrameOptions& options,
               size_t cacheBytes, const Progress& progress);

  // The script's camera, or the captured one that it names, on pictures `scale` times the script's size.
  // Throws Error as cameraAt does, where the model has no camera of the name, and where its pictures have
  // another shape.
  capture::Camera<ObjectSpace> camera(int frame, double scale) const;

  // With the AOVs that the script asks for. Throws Error where a track has no value that serves.
  surfels::FrameLayers render(int frame, double scale, surfels::FrameStats& stats);

  // A film that is no longer needed gives its memory to the next.
  void reuse(surfels::FrameLayers film) { workspace_.layers = std::move(film); }

  // One exposure for all previews of the shot, whatever part of it is rendered: the brightest of five frames
  // spread over it is white. 1 where nothing shines. Renders them at a quarter of the size on the first call.
  double previewExposure();

  // In the order of the script.
  const std::vector<scene::PreparedEnvironment>& environments() const { return environments_; }

private:
  surfels::FrameLayers render(int frame, double scale, const std::vector<std::string>& aovs,
                              surfels::FrameStats& stats);

  const scene::Script& script_;
  const model::Model& model_;
  surfels::FrameOptions options_;
  std::vector<scene::PreparedEnvironment> environments_;
  const Progress& progress_;
  surfels::FrameWorkspace workspace_;
  std::optional<double> exposure_;
};

} // namespace surflect::film
