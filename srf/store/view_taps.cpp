#include "srf/store/view_taps.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <span>

namespace surflect {

namespace {

float squared(float x) { return x * x; }

} // namespace

void ViewTaps::add(uint32_t block, int corner, int texel, float weight) {
  auto* const end = blocks_.data() + count_;
  auto* const found =
      std::find_if(blocks_.data(), end, [&](const auto& other) { return other.block == block; });
  if (found == end) addBlock({block, {}});
  BlockTaps& taps = found->taps;
  taps.weights[corner] = weight;
  taps.texels[corner] = static_cast<uint8_t>(texel);
}

void ViewTaps::divideWeights(float sum) {
  for (PlacedTaps& placed : std::span(blocks_).first(count_))
    for (float& weight : placed.taps.weights) weight /= sum;
}

ViewTaps tapsAt(const ViewFile& view, const TexelPlace& place) {
  ViewTaps taps;
  if (place.isInOneBlock()) {
    // Those of no weight are not left out, though they may be outside the image: blocks are whole.
    if (const auto block = view.find(place.block())) taps.addBlock({*block, place.taps()});
    return taps;
  }
  float kept = 0;
  bool isWhole = true;
  for (int corner = 0; corner < 4; ++corner) {
    const float weight = place.weight(corner);
    if (weight == 0) continue; // also keeps what follows inside the image
    const int x = place.x + (corner & 1), y = place.y + (corner >> 1);
    const auto block = view.find({x / blockSize, y / blockSize});
    if (!block) {
      isWhole = false;
      continue;
    }
    taps.add(*block, corner, y % blockSize * blockSize + x % blockSize, weight);
    kept += weight;
  }
  if (!isWhole && !taps.empty()) taps.divideWeights(kept);
  return taps;
}

std::optional<StoredPoint> nearestStored(const ViewFile& view, float x, float y) {
  const ViewHeader& header = view.header();
  x = std::clamp(x, 0.5f, static_cast<float>(header.width) - 0.5f);
  y = std::clamp(y, 0.5f, static_cast<float>(header.height) - 0.5f);
  const int cx = static_cast<int>(x) / blockSize, cy = static_cast<int>(y) / blockSize;
  std::optional<StoredPoint> nearest;
  float least = std::numeric_limits<float>::infinity(); // squared
  const auto offer = [&](int bx, int by) {
    if (bx < 0 || by < 0 || bx >= header.blocksAcross() || by >= header.blocksDown() || !view.find({bx, by}))
      return;
    // Centres of its outermost texels; those beyond the image's border are not asked for.
    const auto inside = [](float value, int block, int size) {
      const int last = std::min((block + 1) * blockSize, size) - 1;
      return std::clamp(value, static_cast<float>(block * blockSize) + 0.5f, static_cast<float>(last) + 0.5f);
    };
    const StoredPoint here{inside(x, bx, header.width), inside(y, by, header.height)};
    const float distance = squared(here.x - x) + squared(here.y - y);
    if (distance < least) least = distance, nearest = here;
  };
  const int rings = std::max(header.blocksAcross(), header.blocksDown());
  for (int ring = 0; ring < rings; ++ring) {
    const auto reach = static_cast<float>((ring - 1) * blockSize); // no block of the ring is nearer
    if (ring > 0 && squared(reach) > least) break;
    for (int d = -ring; d <= ring; ++d) {
      offer(cx + d, cy - ring);
      offer(cx + d, cy + ring);
      if (std::abs(d) == ring) continue; // the corners are done
      offer(cx - ring, cy + d);
      offer(cx + ring, cy + d);
    }
  }
  return nearest;
}

} // namespace surflect
