// A script and its model, ready to render any frame of the shot.
#pragma once

#include "render/surfels/frame.h"

#include <optional>
#include <utility>
#include <vector>

namespace surflect {

class ShotRenderer {
public:
  // Prepares the script's environments. The script is one that requireShot accepts, options.aovs do not
  // matter; script, model and progress must stay. Throws Error as prepareEnvironments does.
  ShotRenderer(const Script& script, const Model& model, const FrameOptions& options, size_t cacheBytes,
               const Progress& progress);

  // The script's camera, or the captured one that it names, on pictures `scale` times the script's size.
  // Throws Error as cameraAt does, where the model has no camera of the name, and where its pictures have
  // another shape.
  Camera<ObjectSpace> camera(int frame, double scale) const;

  // With the AOVs that the script asks for. Throws Error where a track has no value that serves.
  FrameLayers render(int frame, double scale, FrameStats& stats);

  // A film that is no longer needed gives its memory to the next.
  void reuse(FrameLayers film) { memory_.film = std::move(film); }

  // One exposure for all previews of the shot, whatever part of it is rendered: the brightest of five frames
  // spread over it is white. 1 where nothing shines. Renders them at a quarter of the size on the first call.
  double previewExposure();

  // In the order of the script.
  const std::vector<PreparedEnvironment>& environments() const { return environments_; }

private:
  FrameLayers render(int frame, double scale, const std::vector<std::string>& aovs, FrameStats& stats);

  const Script& script_;
  const Model& model_;
  FrameOptions options_;
  std::vector<PreparedEnvironment> environments_;
  const Progress& progress_;
  BlockCache cache_;
  FrameMemory memory_;
  std::optional<double> exposure_;
};

} // namespace surflect
