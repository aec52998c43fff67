// Converts captures of other formats into a capture folder.
//
// A new format gets a reader that returns a ForeignCapture (foreign_capture.h), a value of ImportFormat and a
// case in import.cpp (docs/adding.md).
#pragma once

#include "srf/capture/capture.h"
#include "srf/import/foreign_capture.h"
#include "srf/import/lamps.h"
#include "srf/import/lit_view.h"
#include "srf/import/made_masks.h"
#include "surfel/base/time.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace surflect::importers {

// Notes on the files of a source.

// Notes photographs with an EXIF orientation, which is not applied; it matters most if only some of a set
// have one. Orientations are as in Picture.
void noteTurned(const std::map<std::filesystem::path, int>& orientations, ForeignCapture& source);

// Notes pictures beside the photographs that no frame uses, except in mask folders, which findMasks()
// reports. `below`: all folders below the root hold photographs.
void noteUnused(ForeignCapture& source, bool below);

// Notes how masks were interpreted, and probable mistakes (srf/capture/mask_file.h). Throws Error if
// `inverted` is set but there are no masks, and Cancelled.
void noteMasks(ForeignCapture& source, bool inverted, const Progress& progress);

// Reports how a capture's pictures will be read: as which colours, and why.

// "colour: 16 pictures as sRGB (PNG sRGB chunk), 2 as gamma 2.2 (PNG gAMA chunk)". Reads headers only. Throws
// Error naming the picture for a statement that cannot be understood, and for an EXR without the
// requested layer.
std::string colorsTaken(const capture::Capture& capture, const Progress& progress);

enum class ImportFormat { colmap, metashape, transforms, middlebury, lights };

struct ImportOptions {
  std::optional<ImportFormat> format; // none: detected by formatOfSource
  std::filesystem::path images; // COLMAP, Metashape: folder of the photographs; empty: images/ of the source
  std::vector<std::string> chunks; // Metashape: labels of those to import; empty: the largest
  std::filesystem::path mesh;      // the object's, instead of the source's geometry; empty: the source's
  std::filesystem::path lights;    // light file of a folder of photographs; empty: the one in it
  LitViewOptions litView;
  std::filesystem::path cameraPlaces; // known places, to whose world poses are brought; empty: none
  LampOptions lamps;                  // lights of photographs whose poses come without them
  std::vector<std::string> test;      // cameras and lights to hold out, in addition to the source's
  size_t testEvery = 0;               // hold out each Nth camera, or light if there is one view; 0: none
  std::optional<MaskMaking> masks;    // makes masks, replacing the source's
  bool invertMasks = false;           // the source's masks are black on the object
  bool fixPremult = false;            // the source's PNG have colours that are multiplied by alpha
  std::optional<capture::ColorSpace> colorSpace; // of all pictures, overriding the source
  bool unevenLights = false;                     // estimates gradients together with unknown strengths
  bool recoverResponse = false;                  // estimates the camera's response from exposure brackets
  bool allowOutside = false;                     // files of the source may lie outside of its folder
};

struct ImportReport {
  ImportFormat format = ImportFormat::transforms;
  size_t views = 0, lights = 0, trainingFrames = 0, testFrames = 0;
  size_t pictures = 0, masks = 0; // files
  uint64_t bytes = 0;             // of pictures and masks
  std::vector<std::string> notes; // how the source was understood, and what was estimated
};

// Format that the options state, or else the first found of: a light file that the options name,
// transforms.json or transforms_train.json, a COLMAP model, cameras.xml, *_par.txt, a light file. Throws
// Error that lists these if none is found.
ImportFormat formatOfSource(const std::filesystem::path& source, const ImportOptions& options);

// Reads a source, decodes its pictures, copies them unchanged (but for fixPremult) into images/ and masks/,
// estimates unknown strengths of directional lights, and writes transforms.json. The output must not exist,
// or be an empty folder; it appears complete or not at all. Pictures smaller or larger than the source's
// lens, but of its aspect ratio, count as resized. Throws Error or Cancelled.
ImportReport importCapture(const std::filesystem::path& source, const std::filesystem::path& output,
                           const ImportOptions& options, const Progress& progress = {});

// Moves frames to the test split: those of the named cameras and lights, and of each Nth camera (light, if
// there is one view). Throws Error for unknown names, and if no training frame is left.
void holdOut(capture::Capture& capture, const std::vector<std::string>& names, size_t every);

} // namespace surflect::importers
