// Textures of a surface light field on disk, one after another.
#pragma once

#include "render/lightfield/slf/field.h"
#include "render/lightfield/slf/field_file.h"
#include "surfel/base/file.h"

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
  // Opens the file; read() names it in errors. Throws Error unless its size is a whole number of texels.
  explicit TextureFile(std::filesystem::path path);
  ~TextureFile() override;
  TextureFile(const TextureFile&) = delete;
  TextureFile& operator=(const TextureFile&) = delete;

  uint64_t texels() const { return texels_; }
  // Places must lie within the file. sizes: texels of the textures of each region.
  void place(TexturePlaces places, std::vector<size_t> sizes);

  // Throws Error also for texels that are not finite.
  std::vector<Texel> read(size_t region, size_t direction) const override;

private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  uint64_t texels_ = 0;
  TexturePlaces places_;
  std::vector<size_t> sizes_;
};

} // namespace surflect::slf
