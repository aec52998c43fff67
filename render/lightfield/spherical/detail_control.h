// Choice of the level of detail whose predicted time fits a budget.
//
// [Domingo 2007, §4.2]: the highest level of detail that satisfies the frame rate. Steps upwards go by thirds
// of a level, so that nothing pops, unless the blend of two levels costs too much where the finer one alone
// does not. Steps downwards are taken at once. Hysteresis: a step upwards needs headroom, and some frames
// since the last step downwards.
#pragma once

#include <cstddef>
#include <functional>

namespace surflect::spherical {

struct ControlOptions {
  double budget = 0.1;    // seconds a frame
  double headroom = 0.92; // share of the budget that a step upwards may use
  int patience = 4;       // frames from a step downwards to one upwards
};

class DetailControl {
public:
  // Starts at level 0.
  DetailControl(size_t levels, const ControlOptions& options);

  double budget() const { return options_.budget; }
  // Level of detail of the next frame, in thirds. `predicted`: seconds of that frame at a level of detail.
  double choose(const std::function<double(double detail)>& predicted);

private:
  int finest_; // in thirds, as the following
  ControlOptions options_;
  int thirds_ = 0, waiting_ = 0;
};

} // namespace surflect::spherical
