// Other people's captures to a capture folder that stands alone.
#pragma once

#include "srf/capture/capture.h"
#include "srf/import/lit_view.h"
#include "surfel/base/progress.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace surflect::importers {

enum class ImportFormat { colmap, transforms, middlebury, lights };

struct ImportOptions {
  std::optional<ImportFormat> format; // none: what the source looks like
  std::filesystem::path images;       // COLMAP: where its names start; empty: images/ of the source
  std::filesystem::path lights;       // the light file of a folder of photographs; empty: the one in it
  LitViewOptions litView;
  std::vector<std::string> test;       // cameras and lights to hold out, beside those that the source does
  size_t testEvery = 0;                // hold out each Nth camera, or light where there is one view; 0: none
  std::optional<double> maskThreshold; // masks by threshold, in the place of the source's
  bool invertMasks = false;            // of the source: black is the object
  std::optional<capture::ColorSpace> colorSpace; // of the pictures, whatever the source says
  bool unevenLights = false;                     // where strengths are estimated: with their gradients
  bool recoverResponse = false;                  // of the camera, from exposure brackets
  bool allowOutside = false;                     // files of the source can lie out of its folder
};

struct ImportReport {
  ImportFormat format = ImportFormat::transforms;
  size_t views = 0, lights = 0, trainingFrames = 0, testFrames = 0;
  size_t pictures = 0, masks = 0; // files
  uint64_t bytes = 0;             // of both
  std::vector<std::string> notes; // how the source was understood, and what was estimated
};

// What a source looks like: transforms.json, then COLMAP's model, then *_par.txt, then a light file. Throws
// Error that names them where it is none of these.
ImportFormat formatOfSource(const std::filesystem::path& source, const ImportOptions& options);

// Reads a source, copies its pictures as they are into images/ and masks/ of the output, estimates unknown
// strengths of directional lights, and writes transforms.json. The output must not exist, or be an empty
// folder; it appears complete or not at all. Pictures of another size than the source's lens, but of its
// shape, are taken for shrunk ones. Throws Error or Cancelled.
ImportReport importCapture(const std::filesystem::path& source, const std::filesystem::path& output,
                           const ImportOptions& options, const Progress& progress = {});

// Moves frames to the test split: those of the cameras and lights named, and each Nth camera's (light's,
// where there is one view). Throws Error for names it does not know, and where nothing is left to train with.
void holdOut(capture::Capture& capture, const std::vector<std::string>& names, size_t every);

} // namespace surflect::importers
