// A film as one file, encoded by ffmpeg where it is installed.
#pragma once

#include "render/film/display.h"
#include "srf/image/exr.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"

#include <filesystem>
#include <string>
#include <vector>

namespace surflect::film {

// Returns whether ffmpeg is in the path of programs.
bool canEncodeVideo();

// Rate of a film's frames, 1e-9..1e6 a second, as a fraction: within 1e-9 of it, or 24000/1001 for 23.976 and
// 23.98, and so for the other rates of NTSC.
image::FrameRate frameRate(double framesPerSecond);

enum class VideoFormat {
  h264,      // .mp4, 4:2:0, 8 bits; opaque
  proRes422, // .mov, HQ, 10 bits; opaque
  proRes4444 // .mov, 4:4:4, with straight alpha
};

// Format by the name's end, .mp4 or .mov; an MP4 has no alpha.
VideoFormat videoFormat(const std::filesystem::path& file, bool isTransparent);

// Bits of the samples that an encoder of the format takes.
int bitsOf(VideoFormat format);

// Frames of one size, with the matrix and primaries of Rec. 709 and the curve of sRGB. H.264 and ProRes 422
// need even sides: an odd one repeats its last column or row.
class VideoWriter {
public:
  // The file appears when finish() is called. Throws Error if ffmpeg cannot be started.
  VideoWriter(std::filesystem::path file, VideoFormat format, int width, int height, double framesPerSecond);
  // Removes what was written, unless finish() has been called.
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  // The frame has bitsOf(format) bits, and alpha for proRes4444 alone. Throws Error if it has another size or
  // ffmpeg has ended.
  void add(const DisplayPicture& frame);
  // Throws Error if ffmpeg fails, as on a full disk.
  void finish();

private:
  // Returns an Error of the problem, with the last words of ffmpeg in the same line.
  Error failure(const std::string& problem);

  const std::filesystem::path file_;
  const VideoFormat format_;
  const int width_, height_; // of the frames
  AtomicFile target_;
  int messages_ = -1; // file in memory for what ffmpeg complains of
  int socket_ = -1;   // to ffmpeg
  int process_ = -1;
};

// Encodes frames that are on disk, EXR files of one size, as a screen shows them. Where the file's format has
// no alpha, a transparent film is over black. Throws Error as VideoWriter does, and Cancelled.
void writeVideo(const std::filesystem::path& file, const std::vector<std::filesystem::path>& frames,
                double framesPerSecond, const DisplayOptions& display, const Progress& progress);

} // namespace surflect::film
