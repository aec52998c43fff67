// Three levels of images: on disk, in main memory and on the GPU.  [Domingo 2007, §4.1]
//
// The images of level 0 are always on the GPU. An image on its way from disk already has its place in main
// memory, so that neither budget is ever exceeded.
#pragma once

#include "render/lightfield/spherical/direction_tree.h"
#include "render/lightfield/spherical/spherical_file.h"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

namespace surflect::spherical {

// Slots for images: a new image takes the place of the least recently used one that is not needed now.
class LruSlots {
public:
  explicit LruSlots(size_t slots) : slots_(slots) {}

  size_t size() const { return slots_.size(); }
  size_t used() const { return slotOf_.size(); }
  std::optional<uint32_t> find(ImageNumber image) const;

  // Images that are touched from now on keep their slots until the next call.
  void release() { ++now_; }
  // The image has a slot.
  void touch(ImageNumber image) { slots_[slotOf_.at(image)].used = now_; }
  // Pinned images always keep their slots. The image has one.
  void pin(ImageNumber image) { slots_[slotOf_.at(image)].isPinned = true; }
  void unpin(ImageNumber image) { slots_[slotOf_.at(image)].isPinned = false; }
  // Gives an image without slot one, and touches it. Empty if all slots are pinned or have been touched since
  // release().
  std::optional<uint32_t> give(ImageNumber image);
  void remove(ImageNumber image);

private:
  struct Slot {
    std::optional<ImageNumber> image;
    uint64_t used = 0;
    bool isPinned = false;
  };

  std::vector<Slot> slots_;
  std::unordered_map<ImageNumber, uint32_t> slotOf_;
  uint64_t now_ = 1;
};

// Loading of images in the background.
struct LoadedImage {
  ImageNumber number = 0;
  std::shared_ptr<const PencilImage> image; // or none, and `failure`
  std::exception_ptr failure;
};

class ImageLoader {
public:
  virtual ~ImageLoader() = default;
  // Starts loading an image.
  virtual void request(ImageNumber image) = 0;
  // Images that have been loaded since the last call, in any order. `wait`: waits for at least one, unless
  // none is being loaded.
  virtual std::vector<LoadedImage> finished(bool wait) = 0;
};

// Reads images from a source, which must outlive the loader, by tasks of TBB.
class TaskLoader : public ImageLoader {
public:
  // `tasks` images at once; 0: as many as TBB has threads beside this one.
  explicit TaskLoader(const ImageSource& source, int tasks = 0);
  ~TaskLoader() override;
  void request(ImageNumber image) override;
  std::vector<LoadedImage> finished(bool wait) override;

private:
  struct State;
  std::unique_ptr<State> state_;
};

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
