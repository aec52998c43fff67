// Textures of a field in the driver's memory: equal slots, large enough for the largest, are the layers of
// array textures. [Azuma 1999, §3.3]
#pragma once

#include "render/gl/context.h"
#include "render/gl/texture.h"
#include "render/lightfield/slf/field.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace surflect::slf {

// Cache policies for textures that a frame asks for once each, always in the same order.
//
// [Azuma 1999, §3.3]: if the textures of a frame do not fit, plain LRU replaces each texture shortly before
// the next frame asks for it, so that nothing is ever found.
enum class CachePolicy {
  lru,         // replaces the least recently used texture
  modifiedLru, // LRU until the frame has used all slots but groupSize; its later textures share those
               // [Azuma 1999, §3.3]
  planned,     // replaces only textures that the frame does not need, the least recently used first; where
               // there are none, as modifiedLru
};

struct CacheCounts {
  size_t hits = 0, misses = 0;
};

// Which texture is in which slot. Knows nothing of texels.
class TextureCache {
public:
  // A group of up to `groupSize` textures is in the slots at once; slots >= groupSize >= 1. Textures are
  // numbered below `textures`.
  TextureCache(CachePolicy policy, size_t slots, size_t groupSize, size_t textures);

  // Starts a frame. `needed` lists all of its textures, each once, in any order; planned needs it.
  void beginFrame(std::span<const uint32_t> needed = {});

  struct Place {
    uint32_t slot = 0;
    bool isHit = false; // otherwise the caller fills the slot
  };
  // Gives slots to at most groupSize distinct textures, which keep them until the next call.
  std::vector<Place> place(std::span<const uint32_t> group);

  size_t slots() const { return textureOfSlot_.size(); }
  const CacheCounts& counts() const { return counts_; } // since construction

private:
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  uint32_t victim();
  void use(uint32_t slot);
  void assign(uint32_t slot, uint32_t texture);
  bool isKept(uint32_t slot) const;

  CachePolicy policy_;
  size_t groupSize_;
  size_t shared_; // slots below are for textures that are not kept
  size_t nextShared_ = 0;
  uint64_t frame_ = 0, group_ = 0; // numbers of the current ones
  std::vector<uint32_t> textureOfSlot_, slotOfTexture_;
  std::vector<uint64_t> frameOfSlot_, groupOfSlot_; // that last used it
  std::vector<uint64_t> neededInFrame_;             // by texture: the last frame that listed it
  // Slots from the least to the most recently used, as a doubly linked list; the last entry is its head.
  std::vector<uint32_t> before_, after_;
  CacheCounts counts_;
};

struct SlotOptions {
  // Memory for slots. At least kLeastSlots are made, even for a budget of 0, and no more than the field has
  // textures or kMostArrays array textures layers (2048 or more each).
  size_t bytes = size_t{512} << 20;
  CachePolicy policy = CachePolicy::planned;
};
inline constexpr size_t kLeastSlots = 3; // corners of one direction triangle
inline constexpr size_t kMostArrays = 8; // array textures, as in texel.glsl

struct SlotShape {
  int width = 1, height = 1; // of the largest texture, texels
  size_t count = 0;
  size_t layers = 0; // of an array texture; the last one may have fewer

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
  // Array textures for the units of texel.glsl, kMostArrays; missing ones repeat the first.
  std::vector<const gl::Texture*> arrays() const;

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
  std::vector<gl::Texture> arrays_; // of slots / shape_.layers
  CacheCounts atStart_;             // of the frame
  TextureCounts counts_;
};

} // namespace surflect::slf
