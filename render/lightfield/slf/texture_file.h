// Textures of a surface light field on disk, one after another.
#pragma once

#include "render/lightfield/slf/field.h"
#include "render/lightfield/slf/field_file.h"
#include "surfel/base/file.h"
#include "surfel/base/open_file.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <utility>
#include <vector>

namespace surflect::slf {

// Writes textures as they are made. The file appears at commit().
class TextureWriter {
public:
  explicit TextureWriter(const std::filesystem::path& path) : file_(path) {}

  // Returns the place of the texture.
  uint64_t append(std::span<const Texel> texels) {
    file_.write(std::as_bytes(texels));
    return std::exchange(written_, written_ + texels.size());
  }
  uint64_t texels() const { return written_; }
  void commit() { file_.commit(); }

private:
  AtomicFile file_;
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

} // namespace surflect::slf
