// Masks: the pixels that show the object.
#pragma once

#include "srf/image/image.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::image {

struct Mask {
  int width = 0, height = 0;
  std::vector<uint8_t> inside; // width * height, 0 or 1, row 0 on top

  Mask() = default;
  Mask(int w, int h) : width(w), height(h), inside(static_cast<size_t>(w) * static_cast<size_t>(h), 0) {}

  friend bool operator==(const Mask&, const Mask&) = default;
};

// Mask of the pixels whose alpha, the last channel, is above 1/2.
Mask objectMask(const Image& image);
Mask unionOf(const Mask& a, const Mask& b);
// Erosion: pixels whose neighbours within distance n are all in the mask. Outside of the image counts as
// inside, because the image border is not a silhouette.
Mask eroded(const Mask& mask, int n);
// For each pixel of `region`, the index of the pixel of `seeds` with the shortest 8-connected path through
// the region. A pixel without such a path, or outside of the region, gets its own index.
std::vector<size_t> nearestSeeds(const Mask& seeds, const Mask& region);
// Connected pixels of one value.
struct Group {
  std::vector<size_t> pixels;
  bool touchesBorder = false;
};
// Groups of the pixels whose `inside` is `value`, 8-connected if `diagonally`, otherwise 4-connected.
std::vector<Group> groupsOf(const Mask& mask, uint8_t value, bool diagonally);
// |a and b| / |a or b|; 1 for two empty masks.
double intersectionOverUnion(const Mask& a, const Mask& b);

} // namespace surflect::image
