// Light field maps from the factors of vertices.
#pragma once

#include "render/lightfield/lfm/factors.h"
#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/rings.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

class MapStore {
public:
  // Packed maps without content (emptyMaps()), and the rings of their mesh, which must outlive this object.
  MapStore(LightFieldMaps empty, const Rings& rings);

  // Writes the factors of a vertex. Different vertices may be written by several threads at once.
  void put(const Factors& factors, const RingRows& rows, uint32_t vertex);

  // All maps, without those that are 0. Means above twice the root of `white`, a radiance, are cut off.
  LightFieldMaps maps(double white) &&;

private:
  // Share of a corner of a triangle in the mean of a sample, for each channel.
  std::span<float> meanShare(size_t triangle, size_t sample, size_t corner);
  // Sum over the corners, of one channel.
  float meanOf(size_t triangle, size_t sample, size_t channel) const;
  void storeMeans(double white);

  LightFieldMaps maps_;
  const Rings& rings_;
  size_t samples_;                // of a triangle
  std::vector<float> meanShares_; // [triangle][sample][corner][channel]; empty for NMF
};

} // namespace surflect::lfm
