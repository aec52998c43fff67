#include "render/lightfield/slf/texture_cache.h"

#include <cassert>

namespace surflect::slf {

TextureCache::TextureCache(CachePolicy policy, size_t slots, size_t groupSize, size_t textures)
    : policy_(policy), groupSize_(groupSize), shared_(policy == CachePolicy::lru ? 0 : groupSize),
      textureOfSlot_(slots, kNone), slotOfTexture_(textures, kNone), frameOfSlot_(slots), groupOfSlot_(slots),
      neededInFrame_(textures), before_(slots + 1), after_(slots + 1) {
  assert(groupSize >= 1 && slots >= groupSize);
  for (size_t slot = 0; slot <= slots; ++slot) {
    after_[slot] = static_cast<uint32_t>(slot < slots ? slot + 1 : shared_);
    before_[slot] = static_cast<uint32_t>(slot > shared_ ? slot - 1 : slots);
  }
}

void TextureCache::beginFrame(std::span<const uint32_t> needed) {
  ++frame_;
  for (const uint32_t texture : needed) neededInFrame_[texture] = frame_;
}

void TextureCache::use(uint32_t slot) {
  frameOfSlot_[slot] = frame_;
  groupOfSlot_[slot] = group_;
  if (slot < shared_) return;
  after_[before_[slot]] = after_[slot];
  before_[after_[slot]] = before_[slot];
  const auto head = static_cast<uint32_t>(slots());
  before_[slot] = before_[head];
  after_[slot] = head;
  after_[before_[slot]] = before_[head] = slot;
}

void TextureCache::assign(uint32_t slot, uint32_t texture) {
  if (textureOfSlot_[slot] != kNone) slotOfTexture_[textureOfSlot_[slot]] = kNone;
  textureOfSlot_[slot] = texture;
  slotOfTexture_[texture] = slot;
}

// Whether this frame must not replace the slot's texture.
bool TextureCache::isKept(uint32_t slot) const {
  const uint32_t texture = textureOfSlot_[slot];
  switch (policy_) {
  case CachePolicy::lru:
    return false;
  case CachePolicy::modifiedLru:
    return frameOfSlot_[slot] == frame_;
  case CachePolicy::planned:
    return texture != kNone && (frameOfSlot_[slot] == frame_ || neededInFrame_[texture] == frame_);
  }
  return false;
}

uint32_t TextureCache::victim() {
  const auto head = static_cast<uint32_t>(slots());
  for (uint32_t slot = after_[head]; slot != head && frameOfSlot_[slot] != frame_; slot = after_[slot])
    if (!isKept(slot)) return slot;
  if (policy_ == CachePolicy::lru) return after_[head];
  do nextShared_ = (nextShared_ + 1) % shared_;
  while (groupOfSlot_[nextShared_] == group_);
  return static_cast<uint32_t>(nextShared_);
}

std::vector<TextureCache::Place> TextureCache::place(std::span<const uint32_t> group) {
  assert(frame_ > 0 && group.size() <= groupSize_);
  std::vector<Place> places(group.size());
  ++group_;
  // Textures that are there first, lest they be replaced by the others.
  for (size_t i = 0; i < group.size(); ++i)
    if (const uint32_t slot = slotOfTexture_[group[i]]; slot != kNone) {
      places[i] = {slot, true};
      use(slot);
    }
  for (size_t i = 0; i < group.size(); ++i) {
    ++(places[i].isHit ? counts_.hits : counts_.misses);
    if (places[i].isHit) continue;
    const uint32_t slot = victim();
    assign(slot, group[i]);
    use(slot);
    places[i] = {slot, false};
  }
  return places;
}

} // namespace surflect::slf
