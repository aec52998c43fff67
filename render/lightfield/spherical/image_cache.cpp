#include "render/lightfield/spherical/image_cache.h"

#include "surfel/base/error.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cassert>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <utility>

namespace surflect::spherical {

std::optional<uint32_t> LruSlots::find(ImageNumber image) const {
  const auto found = slotOf_.find(image);
  return found == slotOf_.end() ? std::nullopt : std::optional(found->second);
}

std::optional<uint32_t> LruSlots::give(ImageNumber image) {
  assert(!slotOf_.contains(image));
  std::optional<uint32_t> best;
  for (uint32_t s = 0; s < slots_.size(); ++s) {
    const Slot& slot = slots_[s];
    if (!slot.image) {
      best = s;
      break;
    }
    if (!slot.isPinned && slot.used < now_ && (!best || slot.used < slots_[*best].used)) best = s;
  }
  if (!best) return std::nullopt;
  if (slots_[*best].image) slotOf_.erase(*slots_[*best].image);
  slots_[*best] = {image, now_, false};
  slotOf_[image] = *best;
  return best;
}

void LruSlots::remove(ImageNumber image) {
  const auto found = slotOf_.find(image);
  assert(found != slotOf_.end());
  slots_[found->second] = {};
  slotOf_.erase(found);
}

struct TaskLoader::State {
  const ImageSource& source;
  const int tasks;
  tbb::task_arena arena{tasks, 0};
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<ImageNumber> waiting;
  std::vector<LoadedImage> loaded;
  int running = 0;
  bool isEnding = false;

  State(const ImageSource& from, int count) : source(from), tasks(count) {}

  LoadedImage load(ImageNumber number) const {
    try {
      return {number, std::make_shared<const PencilImage>(source.read(number)), {}};
    } catch (...) {
      return {number, {}, std::current_exception()};
    }
  }
  // Loads what is waiting until nothing is.
  void run() {
    std::unique_lock lock(mutex);
    while (!waiting.empty() && !isEnding) {
      const ImageNumber number = waiting.front();
      waiting.pop_front();
      lock.unlock();
      LoadedImage image = load(number);
      lock.lock();
      loaded.push_back(std::move(image));
      changed.notify_all();
    }
    --running;
    changed.notify_all();
  }
};

TaskLoader::TaskLoader(const ImageSource& source, int tasks)
    : state_(std::make_unique<State>(
          source, tasks > 0 ? tasks : std::max(1, tbb::this_task_arena::max_concurrency() - 1))) {}

TaskLoader::~TaskLoader() {
  std::unique_lock lock(state_->mutex);
  state_->isEnding = true;
  state_->changed.wait(lock, [&] { return state_->running == 0; });
}

void TaskLoader::request(ImageNumber image) {
  {
    const std::lock_guard lock(state_->mutex);
    state_->waiting.push_back(image);
    if (state_->running == state_->tasks) return;
    ++state_->running;
  }
  state_->arena.enqueue([state = state_.get()] { state->run(); });
}

std::vector<LoadedImage> TaskLoader::finished(bool wait) {
  std::unique_lock lock(state_->mutex);
  if (wait) state_->changed.wait(lock, [&] { return !state_->loaded.empty() || state_->running == 0; });
  return std::exchange(state_->loaded, {});
}

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
