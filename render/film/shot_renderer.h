// A script and the renderer of its model, ready to render any frame of the shot.
#pragma once

#include "render/method/renderer.h"

#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace surflect::film {

class ShotRenderer {
public:
  // Reads and prepares the script's environments. requireShot must accept the script. Script, renderer and
  // progress must outlive the ShotRenderer. Throws Error as readEnvironments does, and Cancelled.
  ShotRenderer(const scene::Script& script, method::Renderer& renderer, const Progress& progress)
      : ShotRenderer(script, renderer, scene::readEnvironments(script, progress), progress) {}
  // Prepares environments that have been read. The script may also name cameras of `others`.
  ShotRenderer(const scene::Script& script, method::Renderer& renderer,
               std::vector<scene::Environment> environments, const Progress& progress,
               std::vector<capture::View> others = {});

  // Returns the script's camera, or the captured one that it names, for pictures `scale` times the script's
  // size. Throws Error as cameraAt does, if the model has no camera of that name, and if the captured
  // camera's pictures have another shape.
  capture::Camera<ObjectSpace> camera(int frame, double scale) const;

  // Renders a frame with the AOVs that the script asks for. Throws Error if a track has no valid value.
  method::FrameLayers render(int frame, double scale);
  // Renders a frame with these AOVs instead.
  method::FrameLayers render(int frame, double scale, const std::vector<std::string>& aovs);

  // Renders a frame under a constant white environment of radiance 1 instead of its lights: a Lambertian
  // surface shows its albedo.
  method::FrameLayers renderAlbedo(int frame, double scale);

  // Photographs blended at a pixel of such a frame: as Renderer::blendedAt.
  method::PhotographBlend blendedAt(int frame, double scale, capture::Pixel pixel);

  // Reuses the memory of a frame that is no longer needed.
  void reuse(method::FrameLayers film) { memory_ = std::move(film); }

  // Exposure for all previews of the shot, whatever part of it is rendered: the brightest of five frames,
  // spread over the shot, becomes white. 1 if all five are black. The first call renders them, at a quarter
  // of the size.
  double previewExposure();

  // Environments in the order of the script, and the report on preparing each of them.
  const std::vector<scene::Environment>& environments() const { return environments_; }
  const std::vector<method::EnvironmentReport>& environmentReports() const { return environmentReports_; }

private:
  // Returns ask(scene) for the scene of a frame.
  template <class Ask> auto withScene(int frame, double scale, const Ask& ask) const;

  const scene::Script& script_;
  method::Renderer& renderer_;
  std::vector<scene::Environment> environments_;
  std::vector<method::EnvironmentReport> environmentReports_;
  const Progress& progress_;
  const std::vector<capture::View> others_;
  method::FrameLayers memory_;
  std::optional<double> exposure_;
  std::shared_ptr<const weights::EnvironmentMap> white_; // made when it is first needed
};

} // namespace surflect::film
