// Files of a surface light field in its folder (render/lightfield/common/light_field_folder.h), specified in
// docs/format.md.
#pragma once

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/slf/field.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace surflect::slf {

inline constexpr const char* kFormatTag = "surflect surface light field";
inline constexpr int kFormatVersion = 2;
inline constexpr const char* kFieldFile = "field.bin";       // charts, directions, places of textures
inline constexpr const char* kTexturesFile = "textures.bin"; // texels, texture by texture

// Position of each texture in textures.bin, in texels, by region and direction.
using TexturePlaces = std::vector<std::vector<uint64_t>>;
// Place of a direction whose texture is not stored, because no picture can need it (resample.h).
inline constexpr uint64_t kNotStored = UINT64_MAX;

// Content of field.bin.
std::vector<std::byte> fieldBytes(const Field& field, const TexturePlaces& places);

struct StoredField {
  Field field;
  TexturePlaces places;
};
// Reads the content of field.bin for a mesh and a textures.bin with this many texels. Throws Error naming the
// field for bytes that are no such file, also unless each triangle of the mesh is in one region.
StoredField parseField(std::span<const std::byte> bytes, TriangleMesh mesh, uint64_t texels);

// Writes textures as they are made. The file appears at commit().
class TextureWriter {
public:
  explicit TextureWriter(const std::filesystem::path& path) : path_(path), file_(path) {}

  // Returns the place of the texture.
  uint64_t append(std::span<const Texel> texels) {
    file_.write(std::as_bytes(texels));
    return std::exchange(written_, written_ + texels.size());
  }
  // Texels of a texture that was appended, and others in their place. Throw Error naming the file.
  std::vector<Texel> read(uint64_t place, size_t texels);
  void replace(uint64_t place, std::span<const Texel> texels);

  uint64_t texels() const { return written_; }
  void commit() { file_.commit(); }

private:
  std::fstream& at(uint64_t place);
  Error failed(const char* what) const;

  std::filesystem::path path_;
  AtomicFile file_;
  std::fstream again_; // the same file
  uint64_t written_ = 0;
};

// Reads textures by their places; those that are not stored are black and nowhere observed.
class TextureFile : public Textures {
public:
  // Places, which must lie within the file, and regions of a field.
  TextureFile(OpenFile file, TexturePlaces places, std::span<const Region> regions);

  // Throws Error also for texels that are not finite.
  std::vector<Texel> read(size_t region, size_t direction) const override;

private:
  OpenFile file_;
  TexturePlaces places_;
  std::vector<size_t> sizes_; // texels of the textures of each region
};

// Opens the folder of a surface light field.
struct OpenedField {
  lightfield::LightFieldFolder folder;
  Field field;
  std::unique_ptr<const Textures> textures; // read from disk when asked for
};

// Reads all but the textures, whose checksum is checked. Throws Error with file and field for a folder that
// is damaged or of another format, and Cancelled.
OpenedField openField(const std::filesystem::path& folder, const Progress& progress = {});

} // namespace surflect::slf
