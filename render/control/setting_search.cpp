#include "render/control/setting_search.h"

#include <algorithm>
#include <cassert>

namespace surflect::control {

namespace {

class Search {
public:
  Search(std::span<const KnobEffects> knobs, std::span<const FrameModel> frames, const SearchLimits& limits,
         Objective objective, const std::function<bool(const Steps&)>& isExcluded)
      : knobs_(knobs), frames_(frames), limits_(limits), objective_(objective), isExcluded_(isExcluded),
        stages_(frames[0].stageCosts.size()), least_(knobs.size() + 1, std::vector<double>(stages_, 1)),
        steps_(knobs.size(), 0) {
    for (size_t k = knobs.size(); k-- > 0;)
      for (size_t j = 0; j < stages_; ++j) {
        double least = knobs[k][0].ratios[j];
        for (const StepEffect& step : knobs[k]) least = std::min(least, step.ratios[j]);
        least_[k][j] = least_[k + 1][j] * least;
      }
  }

  std::optional<Steps> run() {
    descend(0, std::vector<double>(stages_, 1), std::vector<ErrorSums>(frames_.size()));
    return best_;
  }

private:
  // Chooses the steps of knobs k and later, after ratios and squared errors of those before.
  void descend(size_t k, const std::vector<double>& ratios, const std::vector<ErrorSums>& errors) {
    const double error = largest(errors), cost = leastCost(k, ratios);
    if (!isWithin(error, cost)) return;
    if (k == knobs_.size()) {
      if (isExcluded_ && isExcluded_(steps_)) return;
      best_ = steps_;
      (objective_ == Objective::cost ? limits_.cost : limits_.squaredError) =
          objective_ == Objective::cost ? cost : error;
      return;
    }
    std::vector<double> nextRatios(stages_);
    std::vector<ErrorSums> nextErrors;
    for (size_t step = 0; step < knobs_[k].size(); ++step) {
      const StepEffect& effect = knobs_[k][step];
      for (size_t j = 0; j < stages_; ++j) nextRatios[j] = ratios[j] * effect.ratios[j];
      nextErrors = errors;
      for (size_t f = 0; f < frames_.size(); ++f) nextErrors[f].add(frames_[f].weights[k], effect);
      steps_[k] = step;
      descend(k + 1, nextRatios, nextErrors);
    }
    steps_[k] = 0;
  }

  // Whether something below could be better than the best so far, which is then the limit.
  bool isWithin(double error, double cost) const {
    if (!best_) return error <= limits_.squaredError && cost <= limits_.cost;
    return objective_ == Objective::cost ? error <= limits_.squaredError && cost < limits_.cost
                                         : error < limits_.squaredError && cost <= limits_.cost;
  }

  // Squared error, the largest over the frames.
  double largest(const std::vector<ErrorSums>& errors) const {
    double most = 0;
    for (size_t f = 0; f < frames_.size(); ++f)
      most = std::max(most, errors[f].squaredError(frames_[f].correlation));
    return most;
  }

  // Cost, the largest over the frames, with the smallest ratios of knobs k and later.
  double leastCost(size_t k, const std::vector<double>& ratios) const {
    double most = 0;
    for (const FrameModel& frame : frames_) {
      double sum = 0;
      for (size_t j = 0; j < stages_; ++j) sum += frame.stageCosts[j] * ratios[j] * least_[k][j];
      most = std::max(most, sum);
    }
    return most;
  }

  std::span<const KnobEffects> knobs_;
  std::span<const FrameModel> frames_;
  SearchLimits limits_;
  const Objective objective_;
  const std::function<bool(const Steps&)>& isExcluded_;
  const size_t stages_;
  std::vector<std::vector<double>> least_; // by knob k and stage: product of the least ratios of k and later
  Steps steps_;
  std::optional<Steps> best_;
};

} // namespace

std::optional<Steps> bestSteps(std::span<const KnobEffects> knobs, std::span<const FrameModel> frames,
                               const SearchLimits& limits, Objective objective,
                               const std::function<bool(const Steps&)>& isExcluded) {
  assert(!frames.empty());
  return Search(knobs, frames, limits, objective, isExcluded).run();
}

} // namespace surflect::control
