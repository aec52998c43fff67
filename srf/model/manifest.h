// manifest.json of a model: the meaning of its numbers, and checksums of all its other files. The last field
// is a checksum of the manifest itself. Specified in docs/format.md.
#pragma once

#include "srf/weights/interpolation.h"
#include "srf/weights/light_blend.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::model {

// Version of the folder's layout and of how its content is made; older models must be packed anew.
inline constexpr int kModelVersion = 5;
// Version of a model with alpha planes. All else is as in kModelVersion.
inline constexpr int kAlphaVersion = 6;
// Version of a model with tables. All else is as in kModelVersion.
inline constexpr int kTablesVersion = 7;

// Version of a model with a pixel grid, which may have alpha planes. All else is as in kModelVersion.
inline constexpr int kGridVersion = 8;

inline constexpr const char* kManifestFile = "manifest.json";
inline constexpr const char* kSurfelFormat = "surflect model"; // tag of a surface reflectance field

// Reads the tag "format" from the manifest of a model folder, which selects the renderer that opens it. Empty
// if there is no such tag.
std::string formatOf(const std::filesystem::path& folder);

// Checksums are XXH3-64 as 16 hexadecimal digits.
struct Manifest {
  double white = 1;     // radiance of a white pixel; positive
  double tolerance = 0; // error tolerance of every block; see blockErrorBound
  weights::LightBlend lightBlend;
  weights::InterpolationChoice interpolation; // the default where a file states none
  size_t surfels = 0, views = 0, lights = 0;
  int gridStep = 0;                   // PixelGrid::step; 0 without a grid
  std::string rig, cloud, visibility; // checksums of transforms.json, surfels.ply and fades.bin
  // Checksums of levels.bin, shadows.bin and tables.bin; empty without such a file.
  std::string levels = {}, shadows = {}, tables = {};
  std::vector<std::string> viewChecksums;       // ViewFile::checksum of each view
  std::vector<std::string> alphaChecksums = {}; // of each view's alpha file; empty for an opaque object
};

std::string manifestText(const Manifest& manifest);

// Parses a manifest. Throws Error naming `path` and the field.
Manifest parseManifest(std::string_view text, const std::filesystem::path& path);

// Hash of the manifest, which through its checksums identifies the whole model.
uint64_t identityOf(const Manifest& manifest);

} // namespace surflect::model
