#include "srf/shading/taps.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace surflect::shading {

namespace {

float squared(float x) { return x * x; }

} // namespace

std::optional<StoredPoint> nearestStored(const codec::ViewFile& view, float x, float y) {
  const codec::ViewHeader& header = view.header();
  x = std::clamp(x, 0.5f, static_cast<float>(header.width) - 0.5f);
  y = std::clamp(y, 0.5f, static_cast<float>(header.height) - 0.5f);
  const int cx = static_cast<int>(x) / codec::blockSize, cy = static_cast<int>(y) / codec::blockSize;
  std::optional<StoredPoint> nearest;
  float least = std::numeric_limits<float>::infinity(); // squared distance
  const auto offer = [&](int bx, int by) {
    if (bx < 0 || by < 0 || bx >= header.blocksAcross() || by >= header.blocksDown() || !view.find({bx, by}))
      return;
    // Texel centres at the ends of the block, within the image.
    const auto inside = [](float value, int block, int size) {
      const int last = std::min((block + 1) * codec::blockSize, size) - 1;
      return std::clamp(value, static_cast<float>(block * codec::blockSize) + 0.5f,
                        static_cast<float>(last) + 0.5f);
    };
    const StoredPoint here{inside(x, bx, header.width), inside(y, by, header.height)};
    const float distance = squared(here.x - x) + squared(here.y - y);
    if (distance < least) least = distance, nearest = here;
  };
  const int rings = std::max(header.blocksAcross(), header.blocksDown());
  for (int ring = 0; ring < rings; ++ring) {
    const auto reach = static_cast<float>((ring - 1) * codec::blockSize); // no block of the ring is nearer
    if (ring > 0 && squared(reach) > least) break;
    for (int d = -ring; d <= ring; ++d) {
      offer(cx + d, cy - ring);
      offer(cx + d, cy + ring);
      if (std::abs(d) == ring) continue; // corners are already done
      offer(cx - ring, cy + d);
      offer(cx + ring, cy + d);
    }
  }
  return nearest;
}

} // namespace surflect::shading
