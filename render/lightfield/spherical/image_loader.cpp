#include "render/lightfield/spherical/image_loader.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <utility>

namespace surflect::spherical {

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

} // namespace surflect::spherical
