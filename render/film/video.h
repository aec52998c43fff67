// A film as one file, encoded by ffmpeg where it is installed.
#pragma once

#include "render/film/display.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"

#include <filesystem>
#include <string>

namespace surflect::film {

// Returns whether ffmpeg is in the path of programs.
bool canEncodeVideo();

// The argument of ffmpeg's option -r for a frame rate: 24000/1001 for 23.976, and so for the other rates of
// NTSC.
std::string rateText(double framesPerSecond);

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
  // What ffmpeg has complained of, in one line, behind its end.
  Error failure(const std::string& problem);

  const std::filesystem::path file_;
  const VideoFormat format_;
  const int width_, height_; // of the frames
  AtomicFile target_;
  int messages_ = -1; // file in memory for what ffmpeg complains of
  int socket_ = -1;   // to ffmpeg
  int process_ = -1;
};

} // namespace surflect::film
