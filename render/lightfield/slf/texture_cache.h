// Cache policies for textures that a frame asks for once each, always in the same order.
//
// [Azuma 1999, §3.3]: if the textures of a frame do not fit, plain LRU replaces each texture shortly before
// the next frame asks for it, so that nothing is ever found.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace surflect::slf {

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

} // namespace surflect::slf
