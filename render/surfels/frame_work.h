// Estimated work of a frame, from what it counts rather than from a clock.
#pragma once

#include "render/surfels/frame.h"
#include "surfel/base/time.h"

#include <chrono>
#include <map>
#include <string>

namespace surflect::surfels {

// Work by stage, in nanoseconds of one typical core: rough, but the same on every machine, for any number of
// threads and any cache. It serves to choose between settings.
std::map<std::string, double> workOf(const FrameStats& stats, const FrameOptions& options, size_t pixels);

// Clock of the stages of a frame.

// Adds up the seconds of stages: of the clock, and of the processor by all threads of the process.
class StageClock {
public:
  StageClock(std::map<std::string, double>& seconds, std::map<std::string, double>& ofProcessor)
      : seconds_(seconds), ofProcessor_(ofProcessor) {}
  // Adds the time since the last call to a stage.
  void finish(const std::string& stage) { finish(stage, 1, stage); }
  // Adds `share` of the time since the last call to `stage`, and the remainder to the stage `rest`.
  void finish(const std::string& stage, double share, const std::string& rest) {
    const auto now = std::chrono::steady_clock::now();
    const double processor = processorSeconds();
    const double passed = std::chrono::duration<double>(now - last_).count();
    const double used = processor - lastProcessor_;
    seconds_[stage] += share * passed;
    ofProcessor_[stage] += share * used;
    seconds_[rest] += (1 - share) * passed;
    ofProcessor_[rest] += (1 - share) * used;
    last_ = now;
    lastProcessor_ = processor;
  }

private:
  std::map<std::string, double>& seconds_;
  std::map<std::string, double>& ofProcessor_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  double lastProcessor_ = processorSeconds();
};

} // namespace surflect::surfels
