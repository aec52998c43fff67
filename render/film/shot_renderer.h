// A script and the renderer of its model, ready to render any frame of the shot.
#pragma once

#include "render/renderer.h"

#include <optional>
#include <utility>
#include <vector>

namespace surflect::film {

class ShotRenderer {
public:
  // Reads and prepares the script's environments. The script is one that requireShot accepts; script,
  // renderer and progress must outlive this. Throws Error as readEnvironments does, and Cancelled.
  ShotRenderer(const scene::Script& script, render::Renderer& renderer, const Progress& progress);

  // The script's camera, or the captured one that it names, on pictures `scale` times the script's size.
  // Throws Error as cameraAt does, where the model has no camera of the name, and where its pictures have
  // another shape.
  capture::Camera<ObjectSpace> camera(int frame, double scale) const;

  // With the AOVs that the script asks for. Throws Error where a track has no value that serves.
  render::FrameLayers render(int frame, double scale);

  // A film that is no longer needed gives its memory to the next.
  void reuse(render::FrameLayers film) { memory_ = std::move(film); }

  // One exposure for all previews of the shot, whatever part of it is rendered: the brightest of five frames
  // spread over it is white. 1 where nothing shines. Renders them at a quarter of the size on the first call.
  double previewExposure();

  // In the order of the script, and what preparing each of them gave.
  const std::vector<scene::Environment>& environments() const { return environments_; }
  const std::vector<render::EnvironmentReport>& environmentReports() const { return environmentReports_; }

private:
  render::FrameLayers render(int frame, double scale, const std::vector<std::string>& aovs);

  const scene::Script& script_;
  render::Renderer& renderer_;
  std::vector<scene::Environment> environments_;
  std::vector<render::EnvironmentReport> environmentReports_;
  const Progress& progress_;
  render::FrameLayers memory_;
  std::optional<double> exposure_;
};

} // namespace surflect::film
