#include "render/lightfield/common/pull_push.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <utility>
#include <vector>

namespace surflect::lightfield {

namespace {

struct Level {
  int width = 0, height = 0;
  std::vector<Eigen::Vector4f> texels;

  Eigen::Vector4f& at(int x, int y) { return texels[static_cast<size_t>(y) * width + x]; }
  const Eigen::Vector4f& at(int x, int y) const { return texels[static_cast<size_t>(y) * width + x]; }
};

// Pull: w_(r+1) = min(1, sum w_r), x_(r+1) = sum w_r x_r / sum w_r over the four texels below. The box stands
// for the paper's B-spline filter; saturation keeps observed texels from being diluted by unobserved ones.
Level pulled(const Level& fine) {
  Level coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
  coarse.texels.resize(static_cast<size_t>(coarse.width) * coarse.height);
  for (int y = 0; y < coarse.height; ++y)
    for (int x = 0; x < coarse.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      float weights = 0;
      for (int v = 2 * y; v < std::min(2 * y + 2, fine.height); ++v)
        for (int u = 2 * x; u < std::min(2 * x + 2, fine.width); ++u)
          if (const Eigen::Vector4f& texel = fine.at(u, v); texel[3] > 0) {
            sum += texel[3] * texel.head<3>();
            weights += texel[3];
          }
      coarse.at(x, y) << (weights > 0 ? Eigen::Vector3f(sum / weights) : sum), std::min(1.f, weights);
    }
  return coarse;
}

// Two coarse texels around a fine one, and the share of the second.
struct Pair {
  int first = 0, second = 0;
  float share = 0;
};

Pair around(int fine, int coarseSize) {
  const float place = 0.5f * (static_cast<float>(fine) + 0.5f) - 0.5f;
  const int first = place < 0 ? 0 : static_cast<int>(place);
  return {first, std::min(first + 1, coarseSize - 1), std::max(0.f, place - static_cast<float>(first))};
}

// Push: x_r <- w_r x_r + (1 - w_r) t, where t interpolates level r + 1 bilinearly.
void push(const Level& coarse, Level& fine) {
  for (int y = 0; y < fine.height; ++y) {
    const Pair rows = around(y, coarse.height);
    for (int x = 0; x < fine.width; ++x) {
      Eigen::Vector4f& texel = fine.at(x, y);
      const float weight = texel[3];
      if (weight >= 1) continue;
      const Pair columns = around(x, coarse.width);
      const auto row = [&](int v) -> Eigen::Vector3f {
        return (1 - columns.share) * coarse.at(columns.first, v).head<3>() +
               columns.share * coarse.at(columns.second, v).head<3>();
      };
      Eigen::Vector3f filled = (1 - rows.share) * row(rows.first) + rows.share * row(rows.second);
      if (weight > 0) filled = weight * texel.head<3>() + (1 - weight) * filled;
      texel.head<3>() = filled;
    }
  }
}

} // namespace

void pullPush(std::span<Eigen::Vector4f> texels, int width, int height) {
  assert(width > 0 && height > 0 && texels.size() == static_cast<size_t>(width) * height);
  if (std::ranges::all_of(texels, [](const Eigen::Vector4f& texel) { return texel[3] >= 1; })) return;
  std::vector<Level> levels{{width, height, {texels.begin(), texels.end()}}};
  while (levels.back().texels.size() > 1) levels.push_back(pulled(levels.back()));
  // The coarsest texel is the mean of all. Without any weight its colour is undefined, and black is taken.
  Eigen::Vector4f& mean = levels.back().at(0, 0);
  if (!(mean[3] > 0)) mean.head<3>().setZero();
  for (size_t level = levels.size() - 1; level-- > 0;) push(levels[level + 1], levels[level]);
  std::ranges::copy(levels.front().texels, texels.begin());
}

} // namespace surflect::lightfield
