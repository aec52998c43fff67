#include "srf/shading/kept_look_ups.h"

#include <algorithm>
#include <cassert>
#include <cstring>

namespace surflect::shading {

bool KeptLookUps::begin(const weights::ShadeOptions& options, const weights::QueryBatch& batch,
                        size_t surfels) {
  constexpr size_t kMostBytes = size_t{256} << 20;
  assert(batch.environments.empty() && options.cameras <= weights::kMaxBlended);
  if (options_ == options && extrapolation_ == batch.extrapolation && lights_ == batch.lights &&
      asking_.size() == surfels)
    return true;
  *this = {};
  if (surfels * (sizeof(uint32_t) + 6 * sizeof(float) * batch.lights + sizeof(Slot) * options.cameras) >
      kMostBytes)
    return false;
  options_ = options;
  extrapolation_ = batch.extrapolation;
  lights_ = batch.lights;
  asking_.resize(surfels);
  rows_.resize(6 * lights_ * surfels);
  slots_.resize(options.cameras * surfels);
  return true;
}

// Whether a place already has the row of a query; else it now has, and its slots are empty.
bool KeptLookUps::takeRow(uint32_t place, const weights::QueryBatch& batch, size_t query) {
  static_assert(sizeof(Direction3<AcquisitionSpace>) == 3 * sizeof(float) &&
                sizeof(Rgb) == 3 * sizeof(float));
  const size_t bytes = 3 * sizeof(float) * lights_;
  float *towards = rows_.data() + 6 * lights_ * place, *irradiance = towards + 3 * lights_;
  const auto* asked = batch.towardsLight.data() + query * lights_;
  const Rgb* now = batch.irradiance.data() + query * lights_;
  const bool isSame = asking_[place] == batch.surfels[query] && std::memcmp(towards, asked, bytes) == 0 &&
                      std::memcmp(irradiance, now, bytes) == 0;
  if (isSame) return true;
  asking_[place] = batch.surfels[query];
  std::memcpy(towards, asked, bytes);
  std::memcpy(irradiance, now, bytes);
  return false;
}

void KeptLookUps::assign(uint32_t place, const weights::QueryBatch& batch, size_t query,
                         std::span<const uint32_t> views, uint32_t* slots) {
  const size_t count = options_->cameras, first = count * place;
  assert(views.size() <= count);
  const std::span all(slots_.data() + first, count);
  if (!takeRow(place, batch, query)) std::ranges::fill(all, Slot{});
  std::array<bool, weights::kMaxBlended> isTaken{};
  const auto take = [&](size_t view, size_t slot) {
    isTaken[slot] = true;
    slots[view] = static_cast<uint32_t>(first + slot);
  };
  std::array<bool, weights::kMaxBlended> isPlaced{};
  for (size_t i = 0; i < views.size(); ++i)
    for (size_t slot = 0; slot < count && !isPlaced[i]; ++slot)
      if (all[slot].isKnown && all[slot].view == views[i]) {
        take(i, slot);
        isPlaced[i] = true;
      }
  size_t free = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    if (isPlaced[i]) continue;
    while (isTaken[free]) ++free;
    all[free] = Slot{};
    all[free].view = views[i] & 0x7fffffff;
    take(i, free);
  }
}

} // namespace surflect::shading
