// Textures of a field in the driver's memory: equal slots, large enough for the largest, are the layers of
// one array texture. [Azuma 1999, §3.3]
#pragma once

#include "render/gl/context.h"
#include "render/gl/texture.h"
#include "render/lightfield/slf/field.h"
#include "render/lightfield/slf/texture_cache.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::slf {

struct SlotOptions {
  // Memory for slots. At least kLeastSlots are made, even for a budget of 0, and no more than the field has
  // textures or an array texture layers (2048 or more).
  size_t bytes = size_t{512} << 20;
  CachePolicy policy = CachePolicy::planned;
};
inline constexpr size_t kLeastSlots = 3; // corners of one direction triangle

struct SlotShape {
  int width = 1, height = 1; // of the largest texture, texels
  size_t count = 0;

  size_t bytes() const { // of one
    return static_cast<size_t>(width) * static_cast<size_t>(height) * sizeof(Texel);
  }
};

// As many slots as the budget allows, within the driver's limits. Throws Error if a texture exceeds them.
SlotShape slotsOf(const Field& field, size_t bytes, const gl::Limits& limits);

struct TextureCounts {
  size_t hits = 0, misses = 0;
  size_t bytes = 0;   // uploaded
  double seconds = 0; // for reading and uploading
};

class TextureSlots {
public:
  // Field and textures must outlive the slots.
  TextureSlots(const Field& field, const Textures& textures, const SlotOptions& options,
               const gl::Limits& limits);

  // The most textures that place() takes.
  size_t groupSize() const { return groupSize_; }
  const SlotShape& shape() const { return shape_; }
  const gl::Texture& texture() const { return texture_; }

  uint32_t numberOf(size_t region, size_t direction) const {
    return firstTexture_[region] + static_cast<uint32_t>(direction);
  }
  // Starts a frame that needs textures of these numbers, each once.
  void beginFrame(std::span<const uint32_t> needed);

  // Textures that have been given slots, but whose missing texels are not uploaded yet.
  struct Group {
    size_t region = 0;
    std::vector<uint32_t> directions;
    std::vector<TextureCache::Place> places;
  };
  // Gives slots to distinct directions of a region, at most groupSize(). They stay valid until a later group
  // has them as a place that is not a hit.
  Group place(size_t region, std::span<const uint32_t> directions);
  // Uploads what a group misses. Throws Error where texels cannot be read; call forget() then.
  void upload(const Group& group);
  // Empties all slots: after an exception, some that were given are not filled.
  void forget();
  // Since the start of the frame.
  const TextureCounts& counts() const { return counts_; }

private:
  const Field* field_;
  const Textures* textures_;
  std::vector<uint32_t> firstTexture_; // by region
  SlotShape shape_;
  size_t groupSize_;
  CachePolicy policy_;
  TextureCache cache_;
  gl::Texture texture_;
  CacheCounts atStart_; // of the frame
  TextureCounts counts_;
};

} // namespace surflect::slf
