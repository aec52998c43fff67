#include "srf/codec/shading_queue.h"

#include <algorithm>
#include <cmath>

namespace surflect::codec {

namespace {

// Reflectance image (view, light) at one texel; empty where it is background.
std::optional<Eigen::Vector3d> texelRadiance(BlockCache& cache, uint32_t view, uint32_t light, int x, int y) {
  const std::optional<uint32_t> number = cache.views()[view].find({x / blockSize, y / blockSize});
  if (!number) return std::nullopt;
  const std::shared_ptr<const Block> block = cache.get(view, *number);
  const int8_t* e = block->texel(y % blockSize * blockSize + x % blockSize);
  const float* a = block->light(light);
  Eigen::Vector3d radiance = Eigen::Vector3d::Zero();
  for (int channel = 0; channel < 3; ++channel)
    for (int k = 0; k < block->stride; ++k)
      radiance[channel] += double{a[k]} * e[channel * block->stride + k];
  return radiance;
}

// Bilinear; empty where all four texels are background.
std::optional<Eigen::Vector3d> lookUp(BlockCache& cache, uint32_t view, uint32_t light, double x, double y) {
  const ViewHeader& header = cache.views()[view].header();
  const double left = std::floor(x - 0.5), top = std::floor(y - 0.5);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const double tx : {left, left + 1}) {
    for (const double ty : {top, top + 1}) {
      const double weight = (1 - std::abs(x - 0.5 - tx)) * (1 - std::abs(y - 0.5 - ty));
      if (weight == 0) continue;
      const auto radiance =
          texelRadiance(cache, view, light, static_cast<int>(std::clamp<double>(tx, 0, header.width - 1)),
                        static_cast<int>(std::clamp<double>(ty, 0, header.height - 1)));
      if (!radiance) continue;
      sum += weight * *radiance;
      weights += weight;
    }
  }
  if (weights == 0) return std::nullopt;
  return Eigen::Vector3d(sum / weights);
}

// The point of the area between the centres of a block's texels that is nearest, over all stored blocks.
std::optional<Eigen::Vector2d> nearestTexel(BlockCache& cache, uint32_t view, double x, double y) {
  const ViewFile& file = cache.views()[view];
  const auto clamped = [](double value, int block, int size) {
    return std::clamp(value, block * blockSize + 0.5, std::min((block + 1) * blockSize, size) - 0.5);
  };
  const Eigen::Vector2d from{std::clamp(x, 0.5, file.header().width - 0.5),
                             std::clamp(y, 0.5, file.header().height - 0.5)};
  std::optional<Eigen::Vector2d> nearest;
  for (uint32_t number = 0; number < file.blockCount(); ++number) {
    const BlockPosition block = file.position(number);
    const Eigen::Vector2d here{clamped(from.x(), block.x, file.header().width),
                               clamped(from.y(), block.y, file.header().height)};
    if (!nearest || (here - from).squaredNorm() < (*nearest - from).squaredNorm()) nearest = here;
  }
  return nearest;
}

} // namespace

std::vector<Eigen::Vector3d> executeReference(std::span<const ShadingOp> ops, const LightRows& rows,
                                              size_t targets, BlockCache& cache) {
  std::vector<Eigen::Vector3d> radiance(targets, Eigen::Vector3d::Zero());
  std::vector<double> all(targets), kept(targets);
  const auto add = [&](const ShadingOp& op, double x, double y) {
    if (!lookUp(cache, op.view, 0, x, y)) return;
    kept[op.target] += op.weight;
    for (uint32_t i = op.rowBegin; i < op.rowEnd; ++i) {
      const auto& [color, begin, end] = rows.lights[i];
      const Eigen::Vector3d omega = op.weight * Eigen::Vector3d(color.r, color.g, color.b);
      for (const auto& [light, weight] : std::span(rows.weights).subspan(begin, end - begin))
        radiance[op.target] += weight * omega.cwiseProduct(*lookUp(cache, op.view, light, x, y));
    }
  };
  std::vector<bool> isBlind(targets, true);
  for (const ShadingOp& op : ops) {
    all[op.target] += op.weight;
    if (lookUp(cache, op.view, 0, op.x, op.y)) isBlind[op.target] = false;
  }
  for (const ShadingOp& op : ops) {
    if (!isBlind[op.target])
      add(op, op.x, op.y);
    else if (const auto texel = nearestTexel(cache, op.view, op.x, op.y))
      add(op, texel->x(), texel->y());
  }
  for (size_t target = 0; target < targets; ++target)
    if (kept[target] != 0) radiance[target] *= all[target] / kept[target];
  return radiance;
}

} // namespace surflect::codec
