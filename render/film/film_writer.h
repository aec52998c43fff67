// A film's files, written while its next frames are rendered.
#pragma once

#include "render/film/display.h"
#include "render/film/frame_file.h"
#include "srf/image/png.h"
#include "surfel/base/file.h"

#include <condition_variable>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace surflect::film {

struct MapFile {
  std::filesystem::path path; // PNG
  image::PngSamples samples;
};

struct FrameFiles {
  std::filesystem::path picture; // EXR
  image::ExrAttributes attributes;
  std::optional<std::filesystem::path> preview; // PNG
  DisplayOptions display = {};                  // of the preview
  std::vector<MapFile> maps = {};
  // Called with the seconds that writing took when all files are on disk, by the writing thread.
  std::function<void(double seconds)> written = {};
};

// Frames appear in order, each whole, and its preview and maps before its picture: if a picture exists, it
// and they are whole. Where the disk is slower than the renderer, up to eight frames share one commit.
class FilmWriter {
public:
  enum class Thread { own, callers };

  // On the caller's thread a frame is on disk when write() returns. With a thread of its own, `progress` is
  // called from there.
  FilmWriter(Thread thread, Progress progress);
  // Writes what write() has taken, unless cancelled; errors are lost.
  ~FilmWriter();
  FilmWriter(const FilmWriter&) = delete;
  FilmWriter& operator=(const FilmWriter&) = delete;

  // Takes a frame; waits until the frame before is encoded, so that the layers of at most one frame are held.
  // Throws the Error or Cancelled at which an earlier frame failed; nothing is written after that.
  void write(FrameFiles files, method::FrameLayers film);

  // Waits until all frames are on disk. Returns the seconds that writing took, one number per frame. Throws
  // as write() does.
  std::vector<double> finish();

  // Layers of a frame that has been encoded, for reuse of their memory; may be empty.
  method::FrameLayers spare();

private:
  struct Frame {
    FrameFiles files;
    method::FrameLayers film;
  };

  void encode(const Frame& frame);
  void commit();
  void work();
  void close();

  const Progress progress_;
  // State of the writing thread.
  std::vector<std::unique_ptr<AtomicFile>> pending_;         // written but not committed
  std::vector<std::function<void(double seconds)>> written_; // of frames that are not committed
  size_t committedFrames_ = 0;
  std::vector<double> seconds_;
  // State shared by both threads.
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Frame> frame_; // to be encoded; the writing thread's until it is emptied
  method::FrameLayers spare_;
  bool callerWaits_ = false, isClosed_ = false;
  std::exception_ptr problem_;
  std::thread thread_; // last: it uses the others
};

} // namespace surflect::film
