// The page of a whole object that is turned: light field maps, and the page that draws them by WebGL 2.
//
// [Chen 2002] as render/lightfield/lfm/maps.h.
//
// In the folder (page_folder.h):
//
//   data.js      mesh, frames of vertices, means, the camera to start from; numbers in base64, the low byte
//   first term0.js...  maps and scales of each approximation term, which the page loads one after another
//
// Maps are as maps.bin holds them (docs/format.md): with codebooks and S3TC blocks, if the model has them.
#pragma once

#include "apps/web/page_folder.h"
#include "render/lightfield/lfm/lfm_file.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>

namespace surflect::web {

inline constexpr double kMostStops = 30; // of the exposure, up and down

struct ObjectPageOptions {
  std::optional<double>
      stops; // exposure, as [camera] exposure of scripts; none: white is near that of a turn's film
};

struct ObjectPageReport {
  size_t triangles = 0, vertices = 0, terms = 0;
  double stops = 0;
};

// Throws Error naming the field of maps that a page cannot hold: textures are those that every browser with
// WebGL 2 has.
void requireHeldByPage(const lfm::LightFieldMaps& maps);

// Writes the page of maps that requireHeldByPage() into a folder that exists. The mark's scale is millimetres
// of a unit of the model.
ObjectPageReport writeObjectPage(const lfm::OpenedMaps& model, const std::filesystem::path& folder,
                                 const ObjectPageOptions& options, const PageMark& mark,
                                 const Progress& progress);

} // namespace surflect::web
