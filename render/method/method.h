// A method: one representation of a captured object, how it is built and how its frames are rendered.
//
// Each method has a folder of its own with a function that returns its Method; render/methods.cpp lists them.
#pragma once

#include "render/method/option.h"
#include "render/method/renderer.h"
#include "srf/capture/capture.h"
#include "srf/validation/validation.h"
#include "surfel/base/time.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::method {

struct BuildInput {
  std::filesystem::path source; // capture folder or JSON file; a stage file where a method traces them
  std::filesystem::path mesh;   // replaces the capture's; or empty
  capture::PathRule paths = capture::PathRule::inside;
  std::string stageScale; // a [scale.NAME] of a stage file; or empty
  std::filesystem::path output;
  std::function<void(std::string_view line)> say; // tells people what was found and made
  // Takes findings of the checks of photographs and mesh; may stop the build.
  validation::TakeFindings take = validation::requireNoError;
};

// Report of a build: figures by name. "map_bytes.view" is the entry `view` of the group `map_bytes`.
struct BuildReport {
  std::map<std::string, double> counts;
  std::map<std::string, std::vector<double>> lists;
  std::map<std::string, double> seconds; // by step
};

struct Method {
  std::string tag;     // "slf"
  std::string title;   // "surface light field: textures of the mesh by direction"
  std::string paper;   // "Azuma 1999"
  std::string format;  // "format" of manifest.json; methods that are read alike share one
  bool isBaked = true; // needs views under fixed light
  std::vector<Option> buildOptions, renderOptions;
  // Names of the build options that apply to a finished model in the capture's place, which is compressed.
  std::vector<std::string> compressOptions = {};
  // Throws Error for build options that do not go together; or none.
  std::function<void(const Setting&)> checkBuild = {};
  // Builds the folder of a model. The setting has passed requireSetting(); an option that it does not name
  // has its default. Throws Error and Cancelled. None for surfels, which model::pack makes.
  std::function<BuildReport(const BuildInput&, const Setting&, const Progress&)> build;
  // Opens a model; `setting` is checked, and holds for frames until Renderer::set(). Throws Error, also
  // without OpenGL where the method needs it, and Cancelled.
  std::function<std::unique_ptr<Renderer>(const std::filesystem::path&, const Setting&, const Progress&)>
      open;
};

// Bytes of a model's files, without the relit views that a build keeps beside them (kViewsFolder).
uint64_t modelBytes(const std::filesystem::path& folder);
inline constexpr const char* kViewsFolder = "views";

} // namespace surflect::method
