// A script and the renderer of its model, ready to render any frame of the shot.
#pragma once

#include "render/film/blur_samples.h"
#include "render/method/renderer.h"

#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace surflect::film {

class ShotRenderer {
public:
  // Reads and prepares the script's environments. requireShot must accept the script. Script, renderer and
  // progress must outlive the ShotRenderer. Throws Error as readEnvironments does, and for a ground under a
  // model of fixed light; and Cancelled.
  ShotRenderer(const scene::Script& script, method::Renderer& renderer, const Progress& progress)
      : ShotRenderer(script, renderer, scene::readEnvironments(script, progress), progress) {}
  // Prepares environments that have been read. The script may also name cameras of `others`.
  ShotRenderer(const scene::Script& script, method::Renderer& renderer,
               std::vector<scene::Environment> environments, const Progress& progress,
               std::vector<capture::View> others = {});

  // Returns the script's camera, or the captured one that it names, for pictures `scale` times the script's
  // size. Throws Error as cameraAt does, if the model has no camera of that name, and if the captured
  // camera's pictures have another shape.
  capture::Camera<ObjectSpace> camera(double frame, double scale) const;

  // Renders a frame with the AOVs that the script asks for. The script's exposure at the frame
  // multiplies colours, and the errors predicted of them. Throws Error if a track has no valid value. A
  // blurred frame is the mean of samples(frame) pictures; its depth, which has no mean, is that of the sharp
  // one. Reports of the pictures are added. Memory: eight bytes for each number of a picture.
  method::FrameLayers render(int frame, double scale);
  // Renders a frame with these AOVs instead.
  method::FrameLayers render(int frame, double scale, const std::vector<std::string>& aovs);
  // Renders the instant in the middle of the frame, through the middle of the lens.
  method::FrameLayers renderSharp(int frame, double scale, const std::vector<std::string>& aovs);

  // Renders that instant without the ground, so that alpha is the object's.
  method::FrameLayers renderObject(int frame, double scale, const std::vector<std::string>& aovs);

  // Number of pictures of which a frame is the mean; 1 if the camera does not blur it.
  int samples(int frame) const;
  // How far apart samples of the frame show a point, in pixels.
  struct BlurSteps {
    double motion = 0, defocus = 0; // largest path while the shutter is open, and largest circle of confusion
    int needed = 1;                 // samples without steps of more than kSeenStep
  };
  static constexpr double kSeenStep = 2; // pixels
  BlurSteps blurSteps(int frame, double scale) const;

  // Renders the instant in the middle of the frame, without exposure and ground, under a constant white
  // environment of radiance 1 instead of its lights: a Lambertian surface shows its albedo.
  method::FrameLayers renderAlbedo(int frame, double scale);

  // Photographs blended at a pixel of the sharp frame: as Renderer::blendedAt.
  method::PhotographBlend blendedAt(int frame, double scale, capture::Pixel pixel);

  // Reuses the memory of a frame that is no longer needed.
  void reuse(method::FrameLayers film) { memory_ = std::move(film); }

  // Factor on the colours of all previews of the shot: 1 where the script gives an exposure. Else, whatever
  // part of the shot is rendered, the brightest of five frames, spread over it, becomes white; 1 if all five
  // are black. The first call renders them, at a quarter of the size, sharp and without the ground, whose
  // shadow is no part of the object.
  double previewExposure();

  // Environments in the order of the script, and the report on preparing each of them.
  const std::vector<scene::Environment>& environments() const { return environments_; }
  const std::vector<method::EnvironmentReport>& environmentReports() const { return environmentReports_; }

private:
  // Returns ask(scene) for the scene at a time, through a camera.
  template <class Ask>
  auto withScene(double frame, const capture::Camera<ObjectSpace>& camera, const Ask& ask) const;
  // Renders the scene at a time, through a camera.
  method::FrameLayers picture(double frame, const capture::Camera<ObjectSpace>& camera,
                              const std::vector<std::string>& aovs, bool hasGround = true);
  // Multiplies by the script's exposure at the frame; a remark tells of colours beyond half floats.
  method::FrameLayers exposed(int frame, method::FrameLayers layers) const;
  // The camera of a sample of a blurred frame.
  capture::Camera<ObjectSpace> cameraOf(const scene::ShotBlur& blur, const BlurSample& sample, double frame,
                                        double scale) const;
  double focusDistance(const scene::ShotBlur& blur, const capture::Camera<ObjectSpace>& camera) const;

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
