#include "render/film/video.h"

#include "render/film/frame_file.h"
#include "srf/image/exr.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <spawn.h>
#include <string>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

extern char** environ;

namespace surflect::film {

namespace {

constexpr const char* kEncoder = "ffmpeg";

std::vector<std::string> encoderWords(VideoFormat format, int width, int height, const std::string& rate,
                                      const std::string& file) {
  const bool hasAlpha = format == VideoFormat::proRes4444, isH264 = format == VideoFormat::h264;
  std::vector<std::string> words = {kEncoder,
                                    "-y",
                                    "-loglevel",
                                    "error",
                                    "-xerror",
                                    "-f",
                                    "rawvideo",
                                    "-pix_fmt",
                                    isH264     ? "rgb24"
                                    : hasAlpha ? "rgba64le"
                                               : "rgb48le",
                                    "-s",
                                    fmt::format("{}x{}", width, height),
                                    "-r",
                                    rate,
                                    "-i",
                                    "-",
                                    "-vf",
                                    "scale=out_color_matrix=bt709:out_range=tv:flags=bicubic+accurate_rnd+"
                                    "full_chroma_int+full_chroma_inp,setparams=range=tv:colorspace=bt709:"
                                    "color_primaries=bt709:color_trc=iec61966-2-1"};
  const auto add = [&](std::initializer_list<const char*> more) {
    words.insert(words.end(), more.begin(), more.end());
  };
  if (isH264)
    add({"-c:v", "libx264", "-crf", "16", "-pix_fmt", "yuv420p", "-movflags", "+faststart"});
  else if (hasAlpha)
    add({"-c:v", "prores_ks", "-profile:v", "4444", "-pix_fmt", "yuva444p10le", "-alpha_bits", "16",
         "-vendor", "apl0", "-movflags", "+write_colr"});
  else
    add({"-c:v", "prores_ks", "-profile:v", "hq", "-pix_fmt", "yuv422p10le", "-vendor", "apl0", "-movflags",
         "+write_colr"});
  add({"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-color_range",
       "tv", "-f", isH264 ? "mp4" : "mov"}); // the container's; those of setparams are the pictures' own
  words.push_back(file);
  return words;
}

// Waits for the end of a process; returns whether it has succeeded.
bool hasSucceeded(int process) {
  int status = 0;
  pid_t ended = 0;
  do ended = ::waitpid(process, &status, 0);
  while (ended < 0 && errno == EINTR);
  return ended == process && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

int even(int side) { return side + side % 2; }

// The picture with its last column and row repeated up to a size.
std::vector<uint8_t> padded(const DisplayPicture& frame, int width, int height) {
  const auto stride = static_cast<size_t>(frame.channels * frame.bits / 8); // bytes
  std::vector<uint8_t> bytes;
  bytes.reserve(static_cast<size_t>(width) * static_cast<size_t>(height) * stride);
  for (int y = 0; y < height; ++y) {
    const uint8_t* const row = &frame.bytes[static_cast<size_t>(std::min(y, frame.height - 1)) *
                                            static_cast<size_t>(frame.width) * stride];
    for (int x = 0; x < width; ++x) {
      const uint8_t* const pixel = row + static_cast<size_t>(std::min(x, frame.width - 1)) * stride;
      bytes.insert(bytes.end(), pixel, pixel + stride);
    }
  }
  return bytes;
}

} // namespace

bool canEncodeVideo() {
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

image::FrameRate frameRate(double framesPerSecond) {
  const double ntsc = std::round(framesPerSecond * 1.001); // 24, 30, 60; with every second frame 12, 15, 30
  if (ntsc >= 6 && ntsc <= 240 && std::fmod(ntsc, 3) == 0 &&
      std::abs(framesPerSecond * 1.001 / ntsc - 1) < 2e-4)
    return {static_cast<int>(1000 * ntsc), 1001};
  // Continued fraction of nearest integers.
  int64_t numerator = 1, denominator = 0, before[2] = {0, 1};
  for (double rest = framesPerSecond;;) {
    const int64_t whole = std::llround(rest);
    const int64_t p = whole * numerator + before[0], q = whole * denominator + before[1];
    before[0] = std::exchange(numerator, p);
    before[1] = std::exchange(denominator, q);
    const double found = static_cast<double>(p) / static_cast<double>(q);
    if (q != 0 && std::abs(found - framesPerSecond) <= 1e-9 * framesPerSecond) break;
    rest = 1 / (rest - static_cast<double>(whole));
  }
  return {static_cast<int>(std::abs(numerator)), static_cast<int>(std::abs(denominator))};
}

VideoFormat videoFormat(const std::filesystem::path& file, bool isTransparent) {
  if (file.extension() != ".mov") return VideoFormat::h264;
  return isTransparent ? VideoFormat::proRes4444 : VideoFormat::proRes422;
}

int bitsOf(VideoFormat format) { return format == VideoFormat::h264 ? 8 : 16; }

VideoWriter::VideoWriter(std::filesystem::path file, VideoFormat format, int width, int height,
                         double framesPerSecond)
    : file_(std::move(file)), format_(format), width_(width), height_(height), target_(file_) {
  const bool isEven = format != VideoFormat::proRes4444;
  const image::FrameRate rate = frameRate(framesPerSecond);
  const std::vector<std::string> words =
      encoderWords(format, isEven ? even(width) : width, isEven ? even(height) : height,
                   fmt::format("{}/{}", rate.numerator, rate.denominator),
                   std::filesystem::absolute(target_.temporary()).string());
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  // A socket, unlike a pipe, can be written to without a signal when its other end is closed.
  int ends[2];
  messages_ = ::memfd_create("ffmpeg", MFD_CLOEXEC);
  if (messages_ < 0 || ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    const int problem = errno;
    if (messages_ >= 0) ::close(messages_);
    throw Error(fmt::format("ffmpeg cannot be started ({})", std::strerror(problem))).in(file_);
  }
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, messages_, STDERR_FILENO);
  // In a group of its own, so that Ctrl-C reaches this program alone, which then ends the film.
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
  sigset_t ignored; // by this program, not by ffmpeg
  ::sigemptyset(&ignored);
  ::sigaddset(&ignored, SIGPIPE);
  ::posix_spawnattr_setsigdefault(&attributes, &ignored);
  const int problem = ::posix_spawnp(&process_, kEncoder, &actions, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[0]);
  socket_ = ends[1];
  if (problem != 0) {
    ::close(socket_);
    ::close(messages_);
    throw Error(fmt::format("ffmpeg cannot be started ({})", std::strerror(problem))).in(file_);
  }
}

VideoWriter::~VideoWriter() {
  if (socket_ >= 0) ::close(socket_);
  if (process_ > 0) hasSucceeded(process_);
  ::close(messages_);
}

Error VideoWriter::failure(const std::string& problem) {
  std::array<char, 200> text;
  const ssize_t count = ::pread(messages_, text.data(), text.size(), 0);
  std::string said(text.data(), static_cast<size_t>(std::max<ssize_t>(count, 0)));
  std::ranges::replace(said, '\n', ' ');
  while (said.ends_with(' ')) said.pop_back();
  return Error(problem + (said.empty() ? "" : " (" + said + ")")).in(file_);
}

void VideoWriter::add(const DisplayPicture& frame) {
  if (frame.width != width_ || frame.height != height_)
    throw Error::mismatch("frames of one size, " + sizeText(width_, height_),
                          sizeText(frame.width, frame.height))
        .in(file_);
  assert(frame.bits == bitsOf(format_) && frame.channels == (format_ == VideoFormat::proRes4444 ? 4 : 3));
  const bool isEven = format_ != VideoFormat::proRes4444;
  const bool isPadded = isEven && (width_ % 2 != 0 || height_ % 2 != 0);
  const std::vector<uint8_t> more =
      isPadded ? padded(frame, even(width_), even(height_)) : std::vector<uint8_t>();
  const std::vector<uint8_t>& bytes = isPadded ? more : frame.bytes;
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t written = ::send(socket_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      hasSucceeded(std::exchange(process_, -1)); // by its end it has said why
      throw failure("ffmpeg has ended before the film");
    }
    done += static_cast<size_t>(written);
  }
}

void VideoWriter::finish() {
  ::close(std::exchange(socket_, -1));
  if (!hasSucceeded(std::exchange(process_, -1))) throw failure("ffmpeg could not encode the film");
  target_.commit();
}

void writeVideo(const std::filesystem::path& file, const std::vector<std::filesystem::path>& frames,
                double framesPerSecond, const DisplayOptions& display, const Progress& progress) {
  const VideoFormat format = videoFormat(file, display.isTransparent);
  DisplayOptions shown = display;
  if (format == VideoFormat::h264) shown.isTransparent = false;
  shown.bits = bitsOf(format);
  std::optional<VideoWriter> video;
  for (size_t i = 0; i < frames.size(); ++i) {
    progress("video", static_cast<double>(i) / static_cast<double>(frames.size()));
    const method::FrameLayers picture = readFrame(frames[i]);
    if (!video) video.emplace(file, format, picture.color.width, picture.color.height, framesPerSecond);
    video->add(shownColor(picture, shown));
  }
  if (video) video->finish();
  progress("video", 1);
}

} // namespace surflect::film
