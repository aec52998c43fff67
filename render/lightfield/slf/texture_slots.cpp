#include "render/lightfield/slf/texture_slots.h"

#include "surfel/base/error.h"
#include "surfel/base/stopwatch.h"

#include <algorithm>
#include <cstddef>
#include <string>

namespace surflect::slf {

namespace {

constexpr size_t kLargestGroup = 24;

std::vector<uint32_t> firstTextures(const Field& field) {
  std::vector<uint32_t> first;
  uint32_t next = 0;
  for (size_t region = 0; region < field.regions.size(); ++region) {
    first.push_back(next);
    next += static_cast<uint32_t>(field.directionsOf(region).directions().size());
  }
  return first;
}

// Texels with the last column and the last row once more, which filters read with weight 0, or nearly.
std::vector<Texel> padded(const std::vector<Texel>& texels, size_t width, size_t height) {
  std::vector<Texel> result;
  for (size_t y = 0; y <= height; ++y) {
    const auto row = texels.begin() + static_cast<std::ptrdiff_t>(std::min(y, height - 1) * width);
    result.insert(result.end(), row, row + static_cast<std::ptrdiff_t>(width));
    result.push_back(result.back());
  }
  return result;
}

} // namespace

SlotShape slotsOf(const Field& field, size_t bytes, const gl::Limits& limits) {
  SlotShape shape;
  for (const Region& region : field.regions) {
    shape.width = std::max(shape.width, region.chart.width + 1);
    shape.height = std::max(shape.height, region.chart.height + 1);
  }
  const int largest = std::max(shape.width, shape.height);
  if (largest > limits.textureSize)
    throw Error::mismatch("at most " + std::to_string(limits.textureSize - 1) + " texels, which OpenGL has",
                          std::to_string(largest - 1))
        .at("size of a texture");
  const size_t most = std::min(field.textures(), static_cast<size_t>(limits.arrayLayers));
  shape.count = std::max(kLeastSlots, std::min(bytes / shape.bytes(), most));
  return shape;
}

TextureSlots::TextureSlots(const Field& field, const Textures& textures, const SlotOptions& options,
                           const gl::Limits& limits)
    : field_(&field), textures_(&textures), firstTexture_(firstTextures(field)),
      shape_(slotsOf(field, options.bytes, limits)),
      groupSize_(std::clamp(shape_.count / 8, kLeastSlots, kLargestGroup)), policy_(options.policy),
      cache_(options.policy, shape_.count, groupSize_, field.textures()),
      texture_({gl::Format::rgba16f, shape_.width, shape_.height, static_cast<int>(shape_.count)}) {}

void TextureSlots::beginFrame(std::span<const uint32_t> needed) {
  cache_.beginFrame(needed);
  atStart_ = cache_.counts();
  counts_ = {};
}

void TextureSlots::forget() { cache_ = TextureCache(policy_, shape_.count, groupSize_, field_->textures()); }

TextureSlots::Group TextureSlots::place(size_t region, std::span<const uint32_t> directions) {
  Group group{region, {directions.begin(), directions.end()}, {}};
  std::vector<uint32_t> numbers;
  for (const uint32_t direction : directions) numbers.push_back(numberOf(region, direction));
  group.places = cache_.place(numbers);
  counts_.hits = cache_.counts().hits - atStart_.hits;
  counts_.misses = cache_.counts().misses - atStart_.misses;
  return group;
}

void TextureSlots::upload(const Group& group) {
  const Stopwatch stopwatch;
  const Chart& chart = field_->regions[group.region].chart;
  for (size_t i = 0; i < group.places.size(); ++i) {
    if (group.places[i].isHit) continue;
    const std::vector<Texel> texels = textures_->read(group.region, group.directions[i]);
    const std::vector<Texel> stored =
        padded(texels, static_cast<size_t>(chart.width), static_cast<size_t>(chart.height));
    texture_.upload(std::as_bytes(std::span(stored)), chart.width + 1, chart.height + 1,
                    {.layer = static_cast<int>(group.places[i].slot)});
    counts_.bytes += texels.size() * sizeof(Texel);
  }
  counts_.seconds += stopwatch.seconds();
}

} // namespace surflect::slf
