#include "render/lightfield/slf/texture_slots.h"

#include "surfel/base/error.h"
#include "surfel/base/time.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <string>

namespace surflect::slf {

TextureCache::TextureCache(CachePolicy policy, size_t slots, size_t groupSize, size_t textures)
    : policy_(policy), groupSize_(groupSize), shared_(policy == CachePolicy::lru ? 0 : groupSize),
      textureOfSlot_(slots, kNone), slotOfTexture_(textures, kNone), frameOfSlot_(slots), groupOfSlot_(slots),
      neededInFrame_(textures), before_(slots + 1), after_(slots + 1) {
  assert(groupSize >= 1 && slots >= groupSize);
  for (size_t slot = 0; slot <= slots; ++slot) {
    after_[slot] = static_cast<uint32_t>(slot < slots ? slot + 1 : shared_);
    before_[slot] = static_cast<uint32_t>(slot > shared_ ? slot - 1 : slots);
  }
}

void TextureCache::beginFrame(std::span<const uint32_t> needed) {
  ++frame_;
  for (const uint32_t texture : needed) neededInFrame_[texture] = frame_;
}

void TextureCache::use(uint32_t slot) {
  frameOfSlot_[slot] = frame_;
  groupOfSlot_[slot] = group_;
  if (slot < shared_) return;
  after_[before_[slot]] = after_[slot];
  before_[after_[slot]] = before_[slot];
  const auto head = static_cast<uint32_t>(slots());
  before_[slot] = before_[head];
  after_[slot] = head;
  after_[before_[slot]] = before_[head] = slot;
}

void TextureCache::assign(uint32_t slot, uint32_t texture) {
  if (textureOfSlot_[slot] != kNone) slotOfTexture_[textureOfSlot_[slot]] = kNone;
  textureOfSlot_[slot] = texture;
  slotOfTexture_[texture] = slot;
}

// Whether this frame must not replace the slot's texture.
bool TextureCache::isKept(uint32_t slot) const {
  const uint32_t texture = textureOfSlot_[slot];
  switch (policy_) {
  case CachePolicy::lru:
    return false;
  case CachePolicy::modifiedLru:
    return frameOfSlot_[slot] == frame_;
  case CachePolicy::planned:
    return texture != kNone && (frameOfSlot_[slot] == frame_ || neededInFrame_[texture] == frame_);
  }
  return false;
}

uint32_t TextureCache::victim() {
  const auto head = static_cast<uint32_t>(slots());
  for (uint32_t slot = after_[head]; slot != head && frameOfSlot_[slot] != frame_; slot = after_[slot])
    if (!isKept(slot)) return slot;
  if (policy_ == CachePolicy::lru) return after_[head];
  do nextShared_ = (nextShared_ + 1) % shared_;
  while (groupOfSlot_[nextShared_] == group_);
  return static_cast<uint32_t>(nextShared_);
}

std::vector<TextureCache::Place> TextureCache::place(std::span<const uint32_t> group) {
  assert(frame_ > 0 && group.size() <= groupSize_);
  std::vector<Place> places(group.size());
  ++group_;
  // Textures that are there first, lest they be replaced by the others.
  for (size_t i = 0; i < group.size(); ++i)
    if (const uint32_t slot = slotOfTexture_[group[i]]; slot != kNone) {
      places[i] = {slot, true};
      use(slot);
    }
  for (size_t i = 0; i < group.size(); ++i) {
    ++(places[i].isHit ? counts_.hits : counts_.misses);
    if (places[i].isHit) continue;
    const uint32_t slot = victim();
    assign(slot, group[i]);
    use(slot);
    places[i] = {slot, false};
  }
  return places;
}

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
  const auto layers = static_cast<size_t>(limits.arrayLayers);
  const size_t most = std::min(field.textures(), kMostArrays * layers);
  shape.count = std::max(kLeastSlots, std::min(bytes / shape.bytes(), most));
  shape.layers = std::min(shape.count, layers);
  return shape;
}

namespace {

std::vector<gl::Texture> arraysOf(const SlotShape& shape) {
  std::vector<gl::Texture> arrays;
  for (size_t first = 0; first < shape.count; first += shape.layers)
    arrays.emplace_back(gl::TextureShape{gl::Format::rgba16f, shape.width, shape.height,
                                         static_cast<int>(std::min(shape.layers, shape.count - first))});
  return arrays;
}

} // namespace

TextureSlots::TextureSlots(const Field& field, const Textures& textures, const SlotOptions& options,
                           const gl::Limits& limits)
    : field_(&field), textures_(&textures), firstTexture_(firstTextures(field)),
      shape_(slotsOf(field, options.bytes, limits)),
      groupSize_(std::clamp(shape_.count / 8, kLeastSlots, kLargestGroup)), policy_(options.policy),
      cache_(options.policy, shape_.count, groupSize_, field.textures()), arrays_(arraysOf(shape_)) {}

std::vector<const gl::Texture*> TextureSlots::arrays() const {
  std::vector<const gl::Texture*> arrays(kMostArrays, &arrays_[0]);
  for (size_t i = 0; i < arrays_.size(); ++i) arrays[i] = &arrays_[i];
  return arrays;
}

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
    const uint32_t slot = group.places[i].slot;
    arrays_[slot / shape_.layers].upload(std::as_bytes(std::span(stored)), chart.width + 1, chart.height + 1,
                                         {.layer = static_cast<int>(slot % shape_.layers)});
    counts_.bytes += texels.size() * sizeof(Texel);
  }
  counts_.seconds += stopwatch.seconds();
}

} // namespace surflect::slf
