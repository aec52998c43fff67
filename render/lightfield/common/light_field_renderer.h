// The renderer of every light field: what the methods share, around a function that draws.
#pragma once

#include "render/method/renderer.h"
#include "render/method/rows.h"
#include "render/scene/scene.h"
#include "srf/capture/camera.h"
#include "srf/capture/capture.h"
#include "surfel/math/space.h"

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace surflect::lightfield {

// Scenes that a light field can show: the light is baked in, and the object stands as it was photographed.

// Throws Error unless the scene has no ground, no lights or exactly the light of the photographs, and its
// warp keeps the object's points where they are. `rig` holds the photographs' views and at most one light.
void requireBaked(const scene::Scene& scene, const capture::Capture& rig,
                  std::span<const Point3<AcquisitionSpace>> points);

// The point of the surface that each pixel shows: on the ray through the pixel's middle, at `depth` along the
// viewing axis. Three channels, premultiplied by the alpha of `color`; 0 where depth is infinite.
image::Image surfacePoints(const capture::Camera<AcquisitionSpace>& camera, const image::Image& depth,
                           const image::Image& color);

// A description with the AOV "depth" also gets "position" and "rest", which are equal here: both are made of
// depth (surfacePoints).
class LightFieldRenderer : public method::Renderer {
public:
  struct Parts {
    method::Description description; // its identity names the folder's content and the driver
    std::vector<method::Option> options;
    // Takes a setting for the frames that follow.
    std::function<void(const method::Setting&)> configure;
    // Draws the picture of a camera into `layers`, whose AOVs and report are empty: colour, the named AOVs
    // and the report. Throws Error for a lens that the method cannot draw.
    std::function<void(const capture::Camera<AcquisitionSpace>&, const std::vector<std::string>& aovs,
                       const Progress&, method::FrameLayers& layers)>
        draw;
    std::function<bool(std::optional<double> seconds)> keepBudget = {}; // if the method can
  };

  // Throws Error for options that frames of the light field cannot have.
  LightFieldRenderer(Parts parts, const method::Setting& setting);

  const method::Description& describe() const override { return parts_.description; }
  std::span<const method::Option> options() const override { return parts_.options; }
  // Throws Error as requireBaked() and Parts::draw do.
  method::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, method::FrameLayers memory = {}) override;
  bool keepBudget(std::optional<double> seconds) override {
    return parts_.keepBudget && parts_.keepBudget(seconds);
  }

private:
  void configure(const method::Setting& setting) override;

  Parts parts_;
  std::string identity_; // of folder and driver
};

// Renderer of an open model: an object with `options`, which the rows are bound to, and with draw(camera,
// aovs, progress, layers).
template <class Open, class Struct>
LightFieldRenderer::Parts partsOf(const std::shared_ptr<Open>& open, const method::Rows<Struct>& rows,
                                  method::Description description) {
  return {.description = std::move(description),
          .options = method::optionsOf(rows),
          .configure =
              [open, &rows](const method::Setting& chosen) {
                open->options = method::applied(Struct{}, rows, chosen);
              },
          .draw = [open](const capture::Camera<AcquisitionSpace>& camera,
                         const std::vector<std::string>& aovs, const Progress& progress,
                         method::FrameLayers& layers) { open->draw(camera, aovs, progress, layers); }};
}

// Whether `name` is among the AOVs that are asked for.
bool isAsked(const std::vector<std::string>& aovs, std::string_view name);

// ---------------------------------------------------------------------------------------------------------
// Samples of a pixel: light-field renderers draw larger pictures and average them, so that edges are smooth.

// Default and largest number of samples along each side of a pixel. By default, edges are about as smooth as
// those of splats.
inline constexpr int kSamples = 2, kMostSamples = 8;

// Row of the member `samples` of a method's options.
template <class Struct> method::Row<Struct> samplesRow() {
  return method::row<Struct>("samples", [](auto& o) -> auto& { return o.samples; },
                             {.domain = method::wholeRange(1, kMostSamples),
                              .paper = 1,
                              .preview = 1,
                              .sweep = {kSamples, 1},
                              .help = "samples along each side of a pixel"});
}

// A camera for a picture with samples x samples pixels for each of its own.
capture::Camera<AcquisitionSpace> sampled(const capture::Camera<AcquisitionSpace>& camera, int samples);
// Number of samples of a camera's picture.
double samplesOf(const capture::Camera<AcquisitionSpace>& camera, int samples);

} // namespace surflect::lightfield
