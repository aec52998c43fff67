// Three levels of images: on disk, in main memory and on the GPU.  [Domingo 2007, §4.1]
//
// The images of level 0 are always on the GPU. An image on its way from disk already has its place in main
// memory, so that neither budget is ever exceeded.
#pragma once

#include "render/lightfield/spherical/image_loader.h"
#include "render/lightfield/spherical/lru_slots.h"
#include "render/lightfield/spherical/spherical_file.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>

namespace surflect::spherical {

// Images on the GPU, by slot.
class TextureStore {
public:
  virtual ~TextureStore() = default;
  virtual void upload(uint32_t slot, const PencilImage& image) = 0;
};

struct CacheBudgets {
  size_t memoryBytes = size_t{512} << 20, gpuBytes = size_t{512} << 20;
};

// Numbers of slots in main memory and on the GPU that the budgets allow, at most as many as the field has
// images. `mostLayers`: of the driver. Throws Error naming a budget that is too small: main memory must hold
// one image, the GPU those of level 0 and one more.
struct CacheSlots {
  size_t memory = 0, gpu = 0;
};
CacheSlots slotsFor(const FieldShape& shape, const CacheBudgets& budgets, size_t mostLayers);

enum class Place { gpu, memory, loading, disk };

class ImageCache {
public:
  // Loads the images of level 0 to the GPU. Loader and textures must outlive the cache; textures have
  // slots.gpu slots. Throws Error where an image cannot be read.
  ImageCache(const CacheSlots& slots, ImageLoader& loader, TextureStore& textures);

  Place placeOf(ImageNumber image) const;
  // Images that are wanted keep their places in main memory and on the GPU until they are released.
  void want(ImageNumber image);
  // Slot of an image on the GPU, which it keeps until release().
  std::optional<uint32_t> use(ImageNumber image);
  // Brings an image from main memory to the GPU. Returns whether it is on the GPU afterwards; false if the
  // image is in neither place, or if no slot can be freed.
  bool upload(ImageNumber image);
  // Starts loading an image from disk. Returns false if there is no room: images that are wanted or being
  // loaded fill main memory.
  bool request(ImageNumber image);
  // Takes the images that have been loaded. `wait`: waits until at least one has. Throws Error if an image
  // could not be read.
  void collect(bool wait);
  // Begins a new frame, or a batch of one: images that were wanted or used may be replaced.
  void release() { memory_.release(), gpu_.release(); }
  // Images in main memory may be replaced.
  void releaseMemory() { memory_.release(); }

  size_t memoryUsed() const { return memory_.used(); } // slots, those of images being loaded included

private:
  ImageLoader& loader_;
  TextureStore& textures_;
  LruSlots memory_, gpu_;
  std::unordered_map<ImageNumber, std::shared_ptr<const PencilImage>> images_; // in main memory
};

} // namespace surflect::spherical
