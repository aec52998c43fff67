#include "render/verify/stored_photographs.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <array>
#include <optional>

namespace surflect::verify {

void forEachBlock(const codec::ViewFile& file, std::vector<std::string>& faults, const Progress& progress,
                  const std::function<void(uint32_t, const codec::Block&)>& use) {
  for (uint32_t number = 0; number < file.blockCount(); ++number) {
    progress.checkNowAndThen(number);
    std::optional<codec::Block> block;
    try {
      block = file.read(number);
    } catch (const Error& error) {
      faults.emplace_back(error.what());
    }
    if (block) use(number, *block);
  }
}

Vec3<float> radianceAt(const codec::Block& block, int texel, size_t light) {
  const float* coefficients = block.light(light);
  const int8_t* levels = block.texel(texel);
  Vec3<float> radiance;
  for (int channel = 0; channel < 3; ++channel) {
    float sum = 0;
    for (int k = 0; k < block.stride; ++k)
      sum += coefficients[k] * static_cast<float>(levels[channel * block.stride + k]);
    radiance[channel] = sum;
  }
  return radiance;
}

std::vector<image::Image> storedPictures(const codec::ViewFile& file, const codec::AlphaPlane* alpha,
                                         std::span<const uint32_t> columns, const Progress& progress) {
  const codec::ViewHeader& header = file.header();
  std::vector<image::Image> pictures(columns.size(), image::Image(header.width, header.height, 4));
  for (uint32_t number = 0; number < file.blockCount(); ++number) {
    progress.checkNowAndThen(number);
    const codec::Block block = file.read(number);
    const auto [blockX, blockY] = file.position(number);
    for (int texel = 0; texel < codec::blockTexels; ++texel) {
      if ((block.present >> texel & 1) == 0) continue;
      const int x = blockX * codec::blockSize + texel % codec::blockSize,
                y = blockY * codec::blockSize + texel / codec::blockSize;
      const float a = alpha ? alpha->at(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) : 1;
      for (size_t i = 0; i < columns.size(); ++i) {
        const Vec3<float> radiance = a * radianceAt(block, texel, columns[i]);
        std::ranges::copy(std::array{radiance[0], radiance[1], radiance[2], a}, pictures[i].at(x, y).begin());
      }
    }
  }
  return pictures;
}

} // namespace surflect::verify
