// Radiance of look-ups that later frames take over: while a viewer moves, most surfels blend the views that
// they blended before, under the same light rows.
//
// A row is made of the surfel that asks and of the directions and irradiance of its lights (QueryBatch), for
// cameras and lights that are weighted apart. They are kept with the radiance, and compared bit by bit.
#pragma once

#include "srf/weights/query.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::shading {

class KeptLookUps {
public:
  // Makes room for the look-ups of queries like those of a batch, without environments. Forgets all look-ups
  // unless the last call was for such queries. Returns false if that takes more than 256 MiB: 4 bytes, 24 for
  // each light and 16 for each blended camera, for each surfel.
  bool begin(const weights::ShadeOptions& options, const weights::QueryBatch& batch, size_t surfels);

  // Assigns slots to the views that a place blends for a query: `slots` receives one for each, at most as
  // many as cameras are blended. Safe from many threads at once for different places.
  void assign(uint32_t place, const weights::QueryBatch& batch, size_t query, std::span<const uint32_t> views,
              uint32_t* slots);
  bool isEmpty() const { return !options_; }
  bool isKnown(uint32_t slot) const { return slots_[slot].isKnown; }
  const Rgb& radiance(uint32_t slot) const { return slots_[slot].radiance; }
  void set(uint32_t slot, const Rgb& radiance) {
    slots_[slot].radiance = radiance;
    slots_[slot].isKnown = true;
  }

private:
  struct Slot {
    uint32_t view : 31 = 0, isKnown : 1 = 0;
    Rgb radiance;
  };
  // Lights of a query, which its light row is made of, as bits.
  bool takeRow(uint32_t place, const weights::QueryBatch& batch, size_t query);

  std::optional<weights::ShadeOptions> options_; // none: nothing is kept
  std::vector<weights::LightExtrapolation> extrapolation_;
  size_t lights_ = 0;
  std::vector<uint32_t> asking_; // of each place: the surfel whose row it has
  std::vector<float> rows_;      // of each place and light: direction, irradiance
  std::vector<Slot> slots_;      // of each place: one for each blended camera
};

} // namespace surflect::shading
