// Controller: chooses the setting of a renderer's knobs for each frame of a film, either the cheapest whose
// error stays within a tolerance, or the most accurate that takes at most a given time.
//
// A film is known before it is rendered, so the controller looks ahead. It divides the film into stretches
// of equal length; one setting serves a whole stretch, so that the picture does not flicker.
//
//   1. Effects. In one frame of every four stretches, each knob alone is turned step by step; see
//      knob_effects.h. Then the frames around this one are rendered with one setting. Where errors scatter
//      from frame to frame, as they do under highlights, measured frames must stay so far below the tolerance
//      that 95 % of all frames are expected within 1.2 times the tolerance.
//   2. Search. The model proposes the best setting for the first and the last frame of the stretch. Both
//      frames are rendered with it, and compared with the same frame at full. The measurement corrects the
//      model, which then proposes again, until nothing better is proposed. A setting that was measured to
//      fail is not proposed again. Nor is, for a tolerance, one that is at least as fast by every knob, and,
//      for a time, one that is at most as fast by every knob. If nothing meets the time, the setting that the
//      model takes for fastest is chosen.
//   3. Check. The middle frame is rendered, too. If the setting fails there, if the error is far from the
//      mean of both ends, or, for a tolerance, if separate settings for both halves promise to save more work
//      than choosing them takes, each half becomes a stretch.
//
// Errors of the frames that were measured are true; between them the error is interpolated linearly.
//
// For a tolerance, cost is the work that frames report, not a clock. Then the choice for a frame depends on
// the film, the renderer and the target alone: neither on the frames that were asked before, nor on the
// machine.
#pragma once

#include "render/control/knob_effects.h"
#include "render/method/renderer.h"

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::control {

// Search for the best combination of knob steps under a model.
struct SearchLimits {
  double squaredError = 0; // at most this in every frame
  double cost = 0;         // at most this in every frame
};

enum class Objective { cost, error };

// The steps that minimise the largest objective over the frames, within the limits; empty if no steps keep
// them. Exact: branch and bound over all combinations that `isExcluded` does not reject. Of equally good
// steps, the first in lexicographic order. Errors must not be negative.
std::optional<Steps> bestSteps(std::span<const KnobEffects> knobs, std::span<const FrameModel> frames,
                               const SearchLimits& limits, Objective objective,
                               const std::function<bool(const Steps&)>& isExcluded = {});

struct Target {
  enum class Kind { tolerance, milliseconds };
  Kind kind = Kind::tolerance;
  double most = 0; // relative RMS error of a frame, or wall-clock milliseconds
};

struct FrameRange {
  int first = 0, last = 0; // of the whole film, whatever part of it is rendered
};

struct Choice {
  method::Setting setting;
  double predictedError = 0; // relative RMS
};

// Renders a frame of the film with the renderer's present setting.
using RenderFrame = std::function<method::FrameLayers(int frame)>;

class Controller {
public:
  // Knobs in `held` keep their values: errors are relative to frames in which only the others are at full.
  // The renderer must outlive the controller. Throws Error if the renderer lacks a held knob.
  Controller(method::Renderer& renderer, RenderFrame render, FrameRange film, Target target,
             method::Setting held = {});

  // Leaves the renderer turned to some setting. Throws Error as the renderer does, and if it has knobs but
  // its frames report no work.
  Choice choose(int frame);

  size_t probes() const { return probes_; } // frames rendered so far in order to choose

private:
  using Costs = std::map<std::string, double>; // by stage
  struct Measurement {
    double error = 0, cost = 0;
    Costs costs;
  };
  // A frame that was rendered in order to choose.
  struct Probe {
    image::Image full; // its picture
    std::map<method::Setting, Measurement> measured;
  };
  // Stretches of the film that share one model of the knobs' effects, which is measured in its middle.
  struct Chapter {
    int index = -1;
    std::vector<std::string> names; // of knobs that have effects
    std::vector<KnobEffects> effects;
    std::vector<std::string> stages;
    double scatter = 0; // standard deviation of the logarithm of the error between neighbouring frames
    double margin = 1;  // factor on the tolerance for measured frames
  };
  // Frames with one setting.
  struct Stretch {
    int first, last;
    method::Setting setting;
    std::map<int, double> errors; // of measured frames
  };
  struct Search; // what the search of a stretch has learnt

  void readEffects(int chapter);
  void readScatter(int frame, int first, int last);
  std::vector<Stretch> solve(int first, int last, Search& search);
  bool isWorthDividing(int first, int middle, int last, const Steps& best, const Search& search) const;
  Steps bestFor(const std::vector<int>& frames, Search& search);
  void measureOneByOne(int frame, const Steps& steps, FrameModel& model);
  FrameModel modelOf(int frame);
  Probe& probe(int frame);
  const Measurement& measure(int frame, const method::Setting& setting);
  Measurement rendered(int frame, const method::Setting& setting, Probe& probe);
  Costs costsOf(const method::FrameReport& report, double seconds) const;
  method::Setting settingOf(const Steps& steps) const;
  double tolerance() const { return chapter_.margin * target_.most; } // of measured frames
  bool meets(const Measurement& measurement) const;

  method::Renderer& renderer_;
  const RenderFrame render_;
  const FrameRange film_;
  const Target target_;
  const method::Setting held_;
  std::vector<method::Option> knobs_; // that are not held
  Chapter chapter_;
  std::map<int, Probe> probed_;
  std::vector<Stretch> stretches_; // one, or its parts
  size_t probes_ = 0;
};

} // namespace surflect::control
