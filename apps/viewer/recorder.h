// A film as an MP4 file, encoded by ffmpeg where it is installed.
#pragma once

#include "apps/viewer/display.h"

#include <filesystem>

namespace surflect::viewer {

// Whether ffmpeg is in the path of programs.
bool canRecord();

class Recorder {
public:
  // Frames of one size, in H.264, tagged as sRGB's colours. The file appears when finish() is called. Throws
  // Error if ffmpeg cannot be started.
  Recorder(std::filesystem::path file, int width, int height, double framesPerSecond);
  // Removes what was written, unless finish() has been called.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // Throws Error if ffmpeg has ended.
  void add(const DisplayPicture& frame);
  // Throws Error if ffmpeg fails.
  void finish();

private:
  const std::filesystem::path file_, partial_;
  const int width_, height_;
  int process_ = -1;
  int pipe_ = -1;
};

} // namespace surflect::viewer
