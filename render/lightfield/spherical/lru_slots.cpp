#include "render/lightfield/spherical/lru_slots.h"

#include <cassert>

namespace surflect::spherical {

std::optional<uint32_t> LruSlots::find(ImageNumber image) const {
  const auto found = slotOf_.find(image);
  return found == slotOf_.end() ? std::nullopt : std::optional(found->second);
}

std::optional<uint32_t> LruSlots::give(ImageNumber image) {
  assert(!slotOf_.contains(image));
  std::optional<uint32_t> best;
  for (uint32_t s = 0; s < slots_.size(); ++s) {
    const Slot& slot = slots_[s];
    if (!slot.image) {
      best = s;
      break;
    }
    if (!slot.isPinned && slot.used < now_ && (!best || slot.used < slots_[*best].used)) best = s;
  }
  if (!best) return std::nullopt;
  if (slots_[*best].image) slotOf_.erase(*slots_[*best].image);
  slots_[*best] = {image, now_, false};
  slotOf_[image] = *best;
  return best;
}

void LruSlots::remove(ImageNumber image) {
  const auto found = slotOf_.find(image);
  assert(found != slotOf_.end());
  slots_[found->second] = {};
  slotOf_.erase(found);
}

} // namespace surflect::spherical
