// Masks that are made from the photographs, where the source has none: by brightness, by plates of the empty
// scene, by a key colour, or from the object's mesh.
#pragma once

#include "srf/import/foreign_capture.h"
#include "srf/import/output_folder.h"
#include "surfel/base/time.h"
#include "surfel/math/rgb.h"

#include <filesystem>
#include <optional>
#include <string_view>

namespace surflect::importers {

struct MaskMaking {
  enum class From { brightness, plate, key, mesh };

  From from = From::brightness;
  double threshold = 0; // brightness: share of each view's 99.5th percentile of luminance
  // plate: a picture for all photographs, or a folder of plates named like pictures or cameras.
  std::filesystem::path path;
  std::optional<Rgb> key; // key: linear; none: the most frequent colour of the pictures' borders
  double margin = 0;      // pixels by which masks grow; negative: shrink
};

// From "brightness:0.05", "plate:FILE", "plate:FOLDER", "key", "key:#rrggbb", "key:r,g,b" (0 to 255, sRGB),
// "mesh". Throws Error.
MaskMaking parseMaskMaking(std::string_view text);

// Writes a mask for each view and names it in the capture, whose frames have none. A mesh, the capture's or
// else the only one in the folder of source or photographs, becomes its geometry. Notes the share of views
// that have a mask, and views whose mask is suspicious: none could be made, it touches the border, is in
// several pieces, or differs from the visual hull of all masks. Throws Error if no view gets a mask, for
// plates of another size, for a mesh that cannot be found or read; and Cancelled.
void makeMasks(ForeignCapture& source, const std::filesystem::path& sourcePath, const MaskMaking& making,
               Copies& copies, const Progress& progress);

// Notes what checkCapture() (srf/validation/validation.h) finds between the photographs and the capture's
// mesh, without the masks, which may have been made from it. The lights must have their places. Throws Error
// for a mesh that cannot be read; and Cancelled.
void noteFitOfMesh(ForeignCapture& source, const Progress& progress);

} // namespace surflect::importers
