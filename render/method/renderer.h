// A renderer: an open model of one method, and the pictures of it.
//
// Programs know renderers by this interface alone; openRenderer() (render/methods.h) makes them.
#pragma once

#include "render/method/option.h"
#include "render/scene/scene.h"
#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::method {

// A rendered frame: colour, further layers by name, and what rendering it took.

// Statistics of a frame, from any renderer.
struct FrameReport {
  std::map<std::string, double> seconds;          // per stage; names are the renderer's own
  std::map<std::string, double> processorSeconds; // per stage, of all threads of the process
  // Counts by name: "surfels.dead" is the entry `dead` of the group `surfels`. The group "work" is the
  // estimated cost of each stage, from counts alone and in one unit for a method: equal frames have equal
  // work on every machine. Methods with options to sweep must report it; it must fall where one makes frames
  // faster.
  std::map<std::string, double> counts;
  std::optional<std::string> remark; // a likely mistake, such as an empty picture: one line
};

struct FrameLayers {
  image::Image color; // RGBA, premultiplied; of the object alone
  // AOVs by name (script.h: aovNames); premultiplied but for depth, which is infinite off the object.
  std::map<std::string, image::Image> aovs;
  FrameReport report = {};
  // Black behind the object: its shadow on the scene's ground. One channel: (1 - a) x strength x density, the
  // alpha that it adds to the object's alpha a. Empty without a ground.
  image::Image shadow = {};
};

struct Description {
  std::string method;                      // tag of the method: "slf"
  std::filesystem::path folder;            // of the model
  std::string identity;                    // names the model's content and all options that determine pixels
  std::map<std::string, size_t> counts;    // size of the model by name: "surfels"
  capture::Capture rig;                    // captured cameras and lights, and the origin of the model
  Point3<AcquisitionSpace, double> middle; // of the box around the object at rest
  std::span<const Point3<AcquisitionSpace>> points; // on the object at rest; live as long as the renderer
  std::vector<std::string> aovs;                    // that frames can have (script.h: aovNames)
  bool isBaked = false;                             // light and shape are those of the photographs
};

struct EnvironmentReport {
  size_t lights = 0;      // that stand for the map; 0: the map is used as it is
  size_t keyLights = 0;   // among them, whose photographs are weighted by camera-light pairs
  bool tabulated = false; // whether weights of captured lights are looked up in a table
  double seconds = 0;
};

// A photograph from which the colour of a pixel is blended.
struct BlendedPhotograph {
  std::string view, light; // identities of camera and light; no light under fixed illumination
  double weight = 0;       // share in the blend: at least 0, and 1 in sum over all photographs
  capture::Pixel place;    // where the photograph shows the pixel's point
};

// The photographs blended at a pixel, by falling weight.
struct PhotographBlend {
  std::vector<BlendedPhotograph> photographs;
  double tables = 0; // share of the pixel's lights that tables of shared reflectance answer, 0..1
};

class Renderer {
public:
  virtual ~Renderer() = default;

  virtual const Description& describe() const = 0;
  // Options that frames of this model can have: as in Method::renderOptions, with the model's own defaults.
  virtual std::span<const Option> options() const = 0;

  // Sets all options for the frames that follow, and with them the identity; those that are not named have
  // their defaults. Throws Error as requireSetting() does, and for Option::atOpening; the options then stay
  // as they were.
  void set(const Setting& setting);

  // Renders one frame: colour, and the named AOVs. Equal scenes have equal bits, whatever was rendered before
  // and for any number of threads. Layers that are no longer needed may be given as memory. One call at a
  // time. Throws Error where a file of the model cannot be read, and Cancelled.
  virtual FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs = {},
                             const Progress& progress = {}, FrameLayers memory = {}) = 0;

  // Photographs blended at a pixel of render()'s picture of the scene. Nothing where the pixel shows no
  // object, and for methods that do not keep the photographs. Takes about as long as a frame without its
  // shading. Throws Error as render() does, and Cancelled.
  virtual PhotographBlend blendedAt(const scene::Scene&, capture::Pixel, const Progress& = {}) { return {}; }

  // Prepares an environment, which render() would otherwise do when it first meets the environment. Throws
  // Cancelled.
  virtual EnvironmentReport prepare(const scene::ShotEnvironment&, const Progress& = {}) { return {}; }

  // Lets the renderer choose its own level of detail from frame to frame, so that a frame takes at most so
  // many seconds. Without a value, frames are at the set options until it is called again. Returns false, and
  // does nothing, if the method has no such control. Throws Error for options that it would overrule.
  virtual bool keepBudget(std::optional<double> /*seconds*/) { return false; }

private:
  // Takes a setting that has passed requireSetting(). An option that it does not name has its default.
  virtual void configure(const Setting& setting) = 0;
};

// The options of a renderer, for messages.
inline Options optionsOf(const Renderer& renderer) {
  return {renderer.describe().method, renderer.options()};
}

} // namespace surflect::method
