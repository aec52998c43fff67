// A renderer: opens a packed model of one format and renders scenes with it.
//
// Programs know renderers by this interface alone. A new one implements Renderer in a folder beside
// render/surfels and gets a line in openRenderer.
#pragma once

#include "render/frame_layers.h"
#include "render/knobs/knob.h"
#include "render/scene/scene.h"
#include "srf/capture/capture.h"
#include "srf/ulr/interpolation.h"
#include "srf/ulr/light_blend.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::render {

// A renderer ignores options that its method does not have.
struct RendererOptions {
  size_t cameras = 3; // blended per place, 1..kMaxBlended
  // Camera-light pairs blended instead, unless weights are separate; default: six under kriging, four under
  // ULR.
  std::optional<size_t> pairs = {};
  // Override the model's choices (InterpolationChoice, LightBlend).
  std::optional<ulr::Interpolation> interpolation = {};
  std::optional<bool> reciprocal = {}, shadows = {};
  std::optional<size_t> lights = {};
  std::optional<ulr::LightFit> lightFit = {};
  std::optional<bool> foreshortened = {};
  bool nearest = false;                // the nearest camera and light alone, without fading: a baseline
  double lowPass = 0.44;               // least standard deviation of a splat, pixels
  size_t cacheBytes = size_t{1} << 30; // for decoded reflectance, or textures on the GPU
};

struct Description {
  std::filesystem::path folder; // of the model
  std::string identity;         // text that names the model's content and all options that determine pixels
  std::map<std::string, size_t> counts;    // size of the model by name: "surfels"
  capture::Capture rig;                    // captured cameras and lights, and the origin of the model
  Point3<AcquisitionSpace, double> middle; // of the box around the object at rest
  std::span<const Point3<AcquisitionSpace>> points; // on the object at rest; live as long as the renderer
};

struct EnvironmentReport {
  size_t lights = 0;      // that stand for the map; 0: the map is used as it is
  size_t keyLights = 0;   // among them, whose photographs are weighted by pairs
  bool tabulated = false; // whether weights of captured lights are looked up in a table
  double seconds = 0;
};

class Renderer {
public:
  virtual ~Renderer() = default;

  virtual const Description& describe() const = 0;

  // The knobs that the renderer has, whatever they are set to.
  virtual std::vector<knobs::Knob> knobs() const { return {}; }
  // The preview setting: the fastest whose pictures are hard to tell from those at full.
  virtual knobs::Setting preview() const { return {}; }
  // Sets all knobs for the frames that follow, and with them the identity. Throws Error for a knob that the
  // renderer lacks and for a value that it cannot take; the knobs then stay as they were.
  virtual void turn(const knobs::Setting& setting) { knobs::requireKnobs(knobs(), setting); }

  // Renders one frame: colour, and those of the named AOVs that the renderer has. Equal scenes have equal
  // bits, whatever was rendered before and for any number of threads. Layers that are no longer needed may be
  // given as memory. One call at a time. Throws Error where a file of the model cannot be read, and
  // Cancelled.
  virtual FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, FrameLayers memory = {}) = 0;

  // Prepares an environment, which render() would otherwise do when it first meets the environment. Throws
  // Cancelled.
  virtual EnvironmentReport prepare(const scene::ShotEnvironment& environment,
                                    const Progress& progress = {}) = 0;
};

// Opens a model with the renderer that the tag "format" of its manifest.json selects; without a tag, with the
// surfel renderer. Throws Error naming file and field, also for an unknown tag; and Cancelled.
std::unique_ptr<Renderer> openRenderer(const std::filesystem::path& model,
                                       const RendererOptions& options = {}, const Progress& progress = {});

} // namespace surflect::render
