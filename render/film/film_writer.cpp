#include "render/film/film_writer.h"

#include "surfel/base/time.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <utility>

namespace surflect::film {

FilmWriter::FilmWriter(Thread thread, Progress progress) : progress_(std::move(progress)) {
  if (thread == Thread::own) thread_ = std::thread([this] { work(); });
}

FilmWriter::~FilmWriter() { close(); }

void FilmWriter::write(FrameFiles files, method::FrameLayers film) {
  std::unique_lock lock(mutex_);
  callerWaits_ = true;
  changed_.wait(lock, [&] { return !frame_ || problem_; });
  callerWaits_ = false;
  if (problem_) std::rethrow_exception(problem_);
  if (thread_.joinable()) {
    frame_.emplace(std::move(files), std::move(film));
    changed_.notify_all();
  } else {
    Frame frame{std::move(files), std::move(film)};
    encode(frame);
    commit();
    spare_ = std::move(frame.film);
  }
}

std::vector<double> FilmWriter::finish() {
  close();
  if (problem_) std::rethrow_exception(problem_);
  return seconds_;
}

method::FrameLayers FilmWriter::spare() {
  const std::lock_guard lock(mutex_);
  return std::exchange(spare_, {});
}

void FilmWriter::close() {
  {
    const std::lock_guard lock(mutex_);
    isClosed_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void FilmWriter::encode(const Frame& frame) {
  const Stopwatch watch;
  const auto& [picturePath, attributes, previewPath, display, maps, written] = frame.files;
  // Another script may have left some, which a resumed film would keep beside the new picture.
  if (previewPath) std::filesystem::remove(*previewPath);
  for (const MapFile& map : maps) std::filesystem::remove(map.path);
  std::string picture, preview;
  std::vector<std::string> mapBytes(maps.size());
  tbb::parallel_invoke([&] { picture = frameBytes(frame.film, attributes, progress_); },
                       [&] {
                         if (previewPath) preview = pngBytes(shownColor(frame.film, display));
                       },
                       [&] {
                         tbb::parallel_for(size_t{0}, maps.size(),
                                           [&](size_t i) { mapBytes[i] = image::pngBytes(maps[i].samples); });
                       });
  const auto add = [&](const std::filesystem::path& path, const std::string& bytes) {
    pending_.push_back(std::make_unique<AtomicFile>(path));
    pending_.back()->write(bytes);
  };
  const size_t before = pending_.size();
  try {
    for (size_t i = 0; i < maps.size(); ++i) add(maps[i].path, mapBytes[i]);
    if (previewPath) add(*previewPath, preview);
    add(picturePath, picture);
  } catch (...) {
    pending_.resize(before); // the frames before this one are whole
    throw;
  }
  seconds_.push_back(watch.seconds());
  written_.push_back(written);
}

void FilmWriter::commit() {
  const Stopwatch watch;
  const auto files = std::exchange(pending_, {});
  AtomicFile::commit(files);
  const auto callbacks = std::exchange(written_, {});
  const double share = watch.seconds() / static_cast<double>(callbacks.size());
  for (const auto& callback : callbacks) {
    seconds_[committedFrames_] += share;
    if (callback) callback(seconds_[committedFrames_]);
    ++committedFrames_;
  }
}

void FilmWriter::work() {
  constexpr size_t kMostFrames = 8; // of a commit
  const auto mayCommit = [&] {
    try {
      commit();
      return std::exception_ptr();
    } catch (...) {
      return std::current_exception();
    }
  };
  std::exception_ptr problem;
  while (!problem) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return frame_ || isClosed_; });
      if (!frame_) break;
    }
    try {
      encode(*frame_);
    } catch (...) {
      problem = std::current_exception();
      break;
    }
    bool shares = false;
    {
      const std::lock_guard lock(mutex_);
      spare_ = std::move(frame_->film);
      frame_.reset();
      shares = callerWaits_ && seconds_.size() - committedFrames_ < kMostFrames;
      changed_.notify_all();
    }
    if (!shares) problem = mayCommit();
  }
  // Frames before the one that failed are committed; what befalls them came first.
  if (const std::exception_ptr earlier = mayCommit()) problem = earlier;
  const std::lock_guard lock(mutex_);
  frame_.reset();
  problem_ = problem;
  changed_.notify_all();
}

} // namespace surflect::film
