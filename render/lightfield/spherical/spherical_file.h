// Spherical light fields on disk: a folder of light_field_folder.h, of format "surflect spherical".
//
//   manifest.json   also levels, size of an image, and the object's sphere
//   level0.tiles .. images of each level in the order of their numbers (tile_file.h)
#pragma once

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/spherical/direction_tree.h"
#include "render/lightfield/spherical/pencil_image.h"
#include "render/lightfield/spherical/tile_file.h"
#include "srf/capture/capture.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace surflect::spherical {

inline constexpr const char* kFormat = "surflect spherical";
inline constexpr int kVersion = 1;

struct FieldShape {
  size_t levels = 1; // 1..kMostLevels
  int size = 128;    // of an image's side, texels: a power of two, kLeastSize..kLargestSize
  Sphere sphere;

  size_t images() const { return imagesUpTo(levels - 1); }
};

// Images by number, wherever they are kept. read() may be called from several threads.
class ImageSource {
public:
  virtual ~ImageSource() = default;
  // Throws Error where an image cannot be read.
  virtual PencilImage read(ImageNumber image) const = 0;
};

// A field that is being written, image by image.
class SphericalWriter {
public:
  // Takes over a folder as LightFieldWriter does. Throws Error.
  SphericalWriter(const std::filesystem::path& folder, const FieldShape& shape);

  // Appends the next image (tile_file.h). Throws Error.
  void append(std::span<const std::byte> encodedTile);
  // Finishes the folder once all images have been appended. Throws Error and Cancelled.
  void commit(const capture::Capture& trainingViews, const TriangleMesh& mesh, const Progress& progress = {});

private:
  lightfield::LightFieldWriter folder_;
  FieldShape shape_;
  size_t appended_ = 0;
  std::optional<TileWriter> level_; // that is being written
};

// A field's images on disk.
class SphericalFile : public ImageSource {
public:
  // Reads the indices of all levels; images are checked when they are read. Throws Error naming file and
  // field if a number is out of range, or a level is missing, truncated or damaged.
  explicit SphericalFile(const lightfield::LightFieldFolder& folder);

  const FieldShape& shape() const { return shape_; }
  PencilImage read(ImageNumber image) const override;
  // Bytes on disk of the images that belong to a level.
  uint64_t bytes(size_t level) const;

private:
  FieldShape shape_;
  std::vector<TileFile> levels_;
};

} // namespace surflect::spherical
