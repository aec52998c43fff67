#include "srf/calibration/threshold_mask.h"

#include "srf/image/color.h"
#include "srf/image/percentile.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cassert>

namespace surflect::calibration {

namespace {

// Shares of the largest group's pixels.
constexpr double kSmall = 0.1;
constexpr double kSmallGap = 0.01;
// Share of the threshold. Shadows get some light from their surroundings: on the Middlebury temple and
// dinosaur, at threshold 0.05, gaps have medians of 0.00 to 0.14 and shadows of 0.22 to 0.85.
constexpr double kDark = 0.18;

struct Group {
  std::vector<size_t> pixels;
  bool touchesBorder = false;
};

// Connected pixels of one value.
std::vector<Group> groupsOf(const image::Mask& mask, uint8_t value, bool diagonally) {
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

float medianOf(const Group& group, const std::vector<float>& luminance) {
  std::vector<float> values;
  for (const size_t i : group.pixels) values.push_back(luminance[i]);
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

std::vector<float> largestLuminance(std::span<const image::Image> photographs) {
  std::vector<float> largest(static_cast<size_t>(photographs[0].width) *
                             static_cast<size_t>(photographs[0].height));
  for (const image::Image& image : photographs) {
    if (image.width != photographs[0].width || image.height != photographs[0].height)
      throw Error("photographs of one view have different sizes");
    const size_t channels = static_cast<size_t>(image.channels);
    for (size_t i = 0; i < largest.size(); ++i) {
      const float* texel = image.values.data() + i * channels;
      largest[i] =
          std::max(largest[i], channels >= 3 ? image::luma({texel[0], texel[1], texel[2]}) : texel[0]);
    }
  }
  return largest;
}

} // namespace

image::Mask objectByThreshold(std::span<const image::Image> photographs, double threshold) {
  assert(!photographs.empty());
  const std::vector<float> luminance = largestLuminance(photographs);
  image::PercentileCounter counter;
  for (const float value : luminance) counter.add(value);
  const double level = threshold * counter.percentile(0.995);
  image::Mask mask(photographs[0].width, photographs[0].height);
  for (size_t i = 0; i < luminance.size(); ++i) mask.inside[i] = static_cast<double>(luminance[i]) > level;

  const std::vector<Group> parts = groupsOf(mask, 1, true);
  size_t largest = 0;
  for (const Group& part : parts) largest = std::max(largest, part.pixels.size());
  const auto isBelow = [&](const Group& group, double share) {
    return static_cast<double>(group.pixels.size()) < share * static_cast<double>(largest);
  };
  const auto isGap = [&](const Group& hole) {
    return !isBelow(hole, kSmallGap) && static_cast<double>(medianOf(hole, luminance)) < kDark * level;
  };
  for (const Group& part : parts)
    if (isBelow(part, kSmall))
      for (const size_t i : part.pixels) mask.inside[i] = 0;
  for (const Group& hole : groupsOf(mask, 0, false))
    if (!hole.touchesBorder && isBelow(hole, kSmall) && !isGap(hole))
      for (const size_t i : hole.pixels) mask.inside[i] = 1;
  return mask;
}

} // namespace surflect::calibration
