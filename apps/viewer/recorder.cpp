#include "apps/viewer/recorder.h"

#include "surfel/base/error.h"

#include <fmt/format.h>

#include <cassert>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <spawn.h>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

extern char** environ;

namespace surflect::viewer {

namespace {

constexpr const char* kEncoder = "ffmpeg";

} // namespace

bool canRecord() {
  const char* const path = std::getenv("PATH");
  if (!path) return false;
  const std::string folders = path;
  for (size_t begin = 0; begin <= folders.size();) {
    const size_t end = std::min(folders.find(':', begin), folders.size());
    if (::access((std::filesystem::path(folders.substr(begin, end - begin)) / kEncoder).c_str(), X_OK) == 0)
      return true;
    begin = end + 1;
  }
  return false;
}

Recorder::Recorder(std::filesystem::path file, int width, int height, double framesPerSecond)
    : file_(std::move(file)), partial_(file_.string() + ".part"), width_(width), height_(height) {
  // Sides of H.264 are even: an odd one is padded by a column or row.
  const std::vector<std::string> words = {
      kEncoder,
      "-y",
      "-loglevel",
      "error",
      "-f",
      "rawvideo",
      "-pix_fmt",
      "rgb24",
      "-s",
      fmt::format("{}x{}", width, height),
      "-r",
      fmt::format("{}", framesPerSecond),
      "-i",
      "-",
      "-vf",
      "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv",
      "-c:v",
      "libx264",
      "-crf",
      "16",
      "-pix_fmt",
      "yuv420p",
      "-colorspace",
      "bt709",
      "-color_primaries",
      "bt709",
      "-color_trc",
      "iec61966-2-1",
      "-color_range",
      "tv",
      "-movflags",
      "+faststart",
      "-f",
      "mp4",
      partial_.string()};
  std::ofstream(partial_).flush(); // the name is taken from now on
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw Error(fmt::format("no pipe to ffmpeg ({})", std::strerror(errno)));
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  const int failure = ::posix_spawnp(&process_, kEncoder, &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[0]);
  pipe_ = ends[1];
  if (failure != 0) {
    ::close(pipe_);
    throw Error(fmt::format("ffmpeg cannot be started ({})", std::strerror(failure)));
  }
}

Recorder::~Recorder() {
  if (pipe_ >= 0) ::close(pipe_);
  if (process_ > 0) ::waitpid(process_, nullptr, 0);
  std::error_code gone;
  std::filesystem::remove(partial_, gone);
}

void Recorder::add(const DisplayPicture& frame) {
  assert(frame.width == width_ && frame.height == height_);
  for (size_t done = 0; done < frame.rgb.size();) {
    const ssize_t written = ::write(pipe_, frame.rgb.data() + done, frame.rgb.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throw Error("ffmpeg has ended before the film").in(file_);
    done += static_cast<size_t>(written);
  }
}

void Recorder::finish() {
  ::close(std::exchange(pipe_, -1));
  int status = 0;
  ::waitpid(std::exchange(process_, -1), &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw Error("ffmpeg could not encode the film").in(file_);
  std::error_code failure;
  std::filesystem::rename(partial_, file_, failure);
  if (failure) throw Error("cannot be written (" + failure.message() + ")").in(file_);
}

} // namespace surflect::viewer
