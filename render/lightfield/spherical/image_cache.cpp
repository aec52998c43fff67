#include "render/lightfield/spherical/image_cache.h"

#include "surfel/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>

namespace surflect::spherical {

namespace {

double mebibytesOf(size_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

size_t slotsWithin(size_t budget, size_t imageBytes, size_t least, const char* field) {
  const size_t slots = budget / imageBytes;
  if (slots < least)
    throw Error::mismatch(fmt::format("at least {:.2f} MiB, for {} images of {:.2f} MiB",
                                      mebibytesOf(least * imageBytes), least, mebibytesOf(imageBytes)),
                          fmt::format("{:.2f} MiB", mebibytesOf(budget)))
        .at(field);
  return slots;
}

} // namespace

CacheSlots slotsFor(const FieldShape& shape, const CacheBudgets& budgets, size_t mostLayers) {
  const size_t bytes = imageBytes(shape.size);
  const size_t roots = imagesUpTo(0), least = std::min(shape.images(), roots + 1);
  return {std::min(slotsWithin(budgets.memoryBytes, bytes, 1, "budget of main memory"), shape.images()),
          std::min({slotsWithin(budgets.gpuBytes, bytes, least, "budget of the GPU"), shape.images(),
                    mostLayers})};
}

ImageCache::ImageCache(const CacheSlots& slots, ImageLoader& loader, TextureStore& textures)
    : loader_(loader), textures_(textures), memory_(slots.memory), gpu_(slots.gpu) {
  for (ImageNumber root = 0; root < imagesUpTo(0);) {
    if (placeOf(root) == Place::memory) {
      upload(root);
      gpu_.pin(root++);
      continue;
    }
    release();
    for (ImageNumber next = root; next < imagesUpTo(0); ++next)
      if (placeOf(next) == Place::disk && !request(next)) break;
    collect(true);
  }
}

Place ImageCache::placeOf(ImageNumber image) const {
  if (gpu_.find(image)) return Place::gpu;
  if (images_.contains(image)) return Place::memory;
  return memory_.find(image) ? Place::loading : Place::disk;
}

void ImageCache::want(ImageNumber image) {
  if (gpu_.find(image)) gpu_.touch(image);
  if (memory_.find(image)) memory_.touch(image);
}

std::optional<uint32_t> ImageCache::use(ImageNumber image) {
  const auto slot = gpu_.find(image);
  if (slot) gpu_.touch(image);
  return slot;
}

bool ImageCache::upload(ImageNumber image) {
  if (gpu_.find(image)) return true;
  const auto found = images_.find(image);
  if (found == images_.end()) return false;
  const auto slot = gpu_.give(image);
  if (!slot) return false;
  textures_.upload(*slot, *found->second);
  return true;
}

bool ImageCache::request(ImageNumber image) {
  if (memory_.find(image)) return true;
  if (!memory_.give(image)) return false;
  memory_.pin(image); // until it has arrived
  std::erase_if(images_, [&](const auto& held) { return !memory_.find(held.first); });
  loader_.request(image);
  return true;
}

void ImageCache::collect(bool wait) {
  std::exception_ptr failure;
  for (LoadedImage& loaded : loader_.finished(wait)) {
    memory_.unpin(loaded.number);
    if (loaded.image) {
      images_[loaded.number] = std::move(loaded.image);
      continue;
    }
    memory_.remove(loaded.number);
    failure = loaded.failure;
  }
  if (failure) std::rethrow_exception(failure);
}

} // namespace surflect::spherical
