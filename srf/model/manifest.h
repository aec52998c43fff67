// manifest.json of a model: what its numbers mean, and the checksums of all its other files. Its last field
// is a checksum of its own, so that no digit of it can change unseen. Specified in docs/format.md.
#pragma once

#include "srf/ulr/light_blend.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::model {

// Of the folder's form and of how its content is made; older models are refused, and packed anew.
inline constexpr int kModelVersion = 5;

inline constexpr const char* kManifestFile = "manifest.json";
inline constexpr const char* kSurfelFormat = "surflect model"; // tag of a surface reflectance field

// The tag "format" in the manifest of a model's folder, which tells how to open it. Empty where there is no
// such text.
std::string formatOf(const std::filesystem::path& folder);

// Checksums are XXH3-64 as 16 hexadecimal digits.
struct Manifest {
  double white = 1;     // radiance of a white pixel; positive
  double tolerance = 0; // of every block
  ulr::LightBlend lightBlend;
  size_t surfels = 0, views = 0, lights = 0;
  std::string rig, cloud, fades;          // checksums of transforms.json, surfels.ply and fades.bin
  std::vector<std::string> viewChecksums; // ViewFile::checksum of each view
};

std::string manifestText(const Manifest& manifest);

// Throws Error naming file and field. `path` is for its messages.
Manifest parseManifest(std::string_view text, const std::filesystem::path& path);

// Of all that the manifest says, and so, through its checksums, of the whole model.
uint64_t identityOf(const Manifest& manifest);

} // namespace surflect::model
