// Slots for images: a new image takes the place of the least recently used one that is not needed now.
#pragma once

#include "render/lightfield/spherical/direction_tree.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

namespace surflect::spherical {

class LruSlots {
public:
  explicit LruSlots(size_t slots) : slots_(slots) {}

  size_t size() const { return slots_.size(); }
  size_t used() const { return slotOf_.size(); }
  std::optional<uint32_t> find(ImageNumber image) const;

  // Images that are touched from now on keep their slots until the next call.
  void release() { ++now_; }
  // The image has a slot.
  void touch(ImageNumber image) { slots_[slotOf_.at(image)].used = now_; }
  // Pinned images always keep their slots. The image has one.
  void pin(ImageNumber image) { slots_[slotOf_.at(image)].isPinned = true; }
  void unpin(ImageNumber image) { slots_[slotOf_.at(image)].isPinned = false; }
  // Gives an image without slot one, and touches it. Empty if all slots are pinned or have been touched since
  // release().
  std::optional<uint32_t> give(ImageNumber image);
  void remove(ImageNumber image);

private:
  struct Slot {
    std::optional<ImageNumber> image;
    uint64_t used = 0;
    bool isPinned = false;
  };

  std::vector<Slot> slots_;
  std::unordered_map<ImageNumber, uint32_t> slotOf_;
  uint64_t now_ = 1;
};

} // namespace surflect::spherical
