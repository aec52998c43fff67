#include "srf/image/mask.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

namespace surflect::image {

Mask objectMask(const Image& image) {
  Mask mask(image.width, image.height);
  for (size_t i = 0; i < mask.inside.size(); ++i)
    mask.inside[i] = image.values[(i + 1) * static_cast<size_t>(image.channels) - 1] > 0.5f;
  return mask;
}

Mask unionOf(const Mask& a, const Mask& b) {
  assert(a.width == b.width && a.height == b.height);
  Mask result(a.width, a.height);
  for (size_t i = 0; i < a.inside.size(); ++i) result.inside[i] = a.inside[i] | b.inside[i];
  return result;
}

Mask eroded(const Mask& mask, int n) {
  assert(n >= 0);
  const int width = mask.width, height = mask.height;
  const auto index = [&](int x, int y) { return static_cast<size_t>(y) * static_cast<size_t>(width) + x; };

  // Distance of each pixel to the nearest pixel of its row outside of the mask.
  constexpr int far = std::numeric_limits<int>::max();
  std::vector<int> gap(mask.inside.size(), far);
  for (int y = 0; y < height; ++y) {
    for (int x = 0, last = -1; x < width; ++x) {
      if (!mask.inside[index(x, y)]) last = x;
      if (last >= 0) gap[index(x, y)] = x - last;
    }
    for (int x = width - 1, last = -1; x >= 0; --x) {
      if (!mask.inside[index(x, y)]) last = x;
      if (last >= 0) gap[index(x, y)] = std::min(gap[index(x, y)], last - x);
    }
  }

  Mask result(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      bool inside = mask.inside[index(x, y)];
      for (int row = std::max(0, y - n); inside && row <= std::min(height - 1, y + n); ++row) {
        const int halfWidth = static_cast<int>(std::sqrt(double(n) * n - double(row - y) * (row - y)));
        inside = gap[index(x, row)] > halfWidth;
      }
      result.inside[index(x, y)] = inside;
    }
  return result;
}

std::vector<size_t> nearestSeeds(const Mask& seeds, const Mask& region) {
  assert(seeds.width == region.width && seeds.height == region.height);
  const int width = seeds.width, height = seeds.height;
  std::vector<size_t> nearest(seeds.inside.size()), front;
  std::iota(nearest.begin(), nearest.end(), size_t{0});
  std::vector<uint8_t> reached = seeds.inside;
  for (size_t i = 0; i < reached.size(); ++i)
    if (reached[i]) front.push_back(i);
  for (size_t next = 0; next < front.size(); ++next) {
    const int x = static_cast<int>(front[next] % static_cast<size_t>(width)),
              y = static_cast<int>(front[next] / static_cast<size_t>(width));
    for (int row = std::max(0, y - 1); row <= std::min(height - 1, y + 1); ++row)
      for (int column = std::max(0, x - 1); column <= std::min(width - 1, x + 1); ++column) {
        const size_t i = static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column);
        if (!region.inside[i] || reached[i]) continue;
        reached[i] = 1;
        nearest[i] = nearest[front[next]];
        front.push_back(i);
      }
  }
  return nearest;
}

std::vector<Group> groupsOf(const Mask& mask, uint8_t value, bool diagonally) {
  const int width = mask.width, height = mask.height;
  std::vector<uint8_t> seen(mask.inside.size());
  std::vector<Group> groups;
  for (size_t start = 0; start < seen.size(); ++start) {
    if (seen[start] || mask.inside[start] != value) continue;
    Group& group = groups.emplace_back();
    group.pixels.push_back(start);
    seen[start] = 1;
    for (size_t next = 0; next < group.pixels.size(); ++next) {
      const int x = static_cast<int>(group.pixels[next] % static_cast<size_t>(width)),
                y = static_cast<int>(group.pixels[next] / static_cast<size_t>(width));
      group.touchesBorder |= x == 0 || y == 0 || x == width - 1 || y == height - 1;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          if ((!diagonally && dx != 0 && dy != 0) || x + dx < 0 || y + dy < 0 || x + dx >= width ||
              y + dy >= height)
            continue;
          const size_t i = static_cast<size_t>(y + dy) * static_cast<size_t>(width) + (x + dx);
          if (seen[i] || mask.inside[i] != value) continue;
          seen[i] = 1;
          group.pixels.push_back(i);
        }
    }
  }
  return groups;
}

double intersectionOverUnion(const Mask& a, const Mask& b) {
  assert(a.width == b.width && a.height == b.height);
  size_t both = 0, either = 0;
  for (size_t i = 0; i < a.inside.size(); ++i) {
    both += a.inside[i] & b.inside[i];
    either += a.inside[i] | b.inside[i];
  }
  return either > 0 ? static_cast<double>(both) / static_cast<double>(either) : 1;
}

} // namespace surflect::image
