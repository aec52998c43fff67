#include "render/control/controller.h"

#include "render/control/knob_effects.h"
#include "surfel/base/error.h"
#include "surfel/base/time.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <ranges>
#include <set>

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

namespace {

constexpr int kLongest = 32;            // frames of a stretch
constexpr int kShortest = 4;            // frames of a part of a stretch
constexpr int kStretchesPerChapter = 4; // that share one model of the knobs' effects
constexpr size_t kMostTries = 8;        // settings measured for a stretch or part
constexpr double kGain = 0.97;     // a setting is worth measuring if it promises this much of the best so far
constexpr double kBend = 0.25;     // of the tolerance: distance from linear at which a stretch is divided
constexpr double kNearly = 1.2;    // times the tolerance, within which 95 % of the frames should be
constexpr double kOneSided = 2.13; // standard deviations that 95 % stay below [Student 1908, of five samples]
constexpr double kSurprise = 1.5;  // ratio of true to predicted error at which a frame gets its own effects
constexpr double kDividing = 4;    // frames at full: about what it costs to divide a stretch
constexpr double kLeastSquaredError = 1e-12; // of a step, so that a correction can raise it
constexpr double kMostSquaredError = 1e6; // that a model learns: the error is infinite if only full is black
constexpr double kInfinite = std::numeric_limits<double>::infinity();

bool isBlack(const image::Image& picture) {
  return relativeRms(image::Image(picture.width, picture.height, picture.channels), picture) == 0;
}

double costIn(const std::map<std::string, double>& costs, const std::string& stage) {
  const auto found = costs.find(stage);
  return found == costs.end() ? 0 : found->second;
}

double sum(const std::map<std::string, double>& costs) {
  double total = 0;
  for (const auto& [stage, cost] : costs) total += cost;
  return total;
}

} // namespace

struct Controller::Search {
  std::map<int, FrameModel> models; // corrected by what was measured
  std::vector<Steps> tried;
  std::map<int, std::set<Steps>> known; // measured in a frame
  std::set<int> ownEffects;             // frames that have been measured knob by knob
};

Controller::Controller(method::Renderer& renderer, RenderFrame render, FrameRange film, Target target,
                       method::Setting held)
    : renderer_(renderer), render_(std::move(render)), film_(film), target_(target), held_(std::move(held)),
      knobs_(method::sweepable(renderer.options(), held_)) {
  method::requireSetting(method::optionsOf(renderer), held_);
}

Choice Controller::choose(int frame) {
  assert(frame >= film_.first && frame <= film_.last);
  if (knobs_.empty() || (target_.kind == Target::Kind::tolerance && target_.most == 0)) return {held_, 0};
  const auto holdsFrame = [&](const Stretch& s) { return frame >= s.first && frame <= s.last; };
  if (std::ranges::none_of(stretches_, holdsFrame)) {
    // The last frame of a stretch is measured with it, but rendered as the first of the next.
    const int index = (frame - film_.first) / kLongest;
    const int first = film_.first + index * kLongest, last = std::min(first + kLongest, film_.last);
    if (const int chapter = index / kStretchesPerChapter; chapter != chapter_.index) readEffects(chapter);
    std::erase_if(probed_, [&](const auto& entry) { return entry.first < first || entry.first > last; });
    Search search;
    stretches_ = solve(first, last, search);
    if (last == first + kLongest && last < film_.last) --stretches_.back().last;
  }
  // The later part renders a frame that two parts share.
  const auto found = std::ranges::find_if(stretches_ | std::views::reverse, holdsFrame);
  const auto after = found->errors.lower_bound(frame);
  if (after->first == frame) return {found->setting, after->second};
  const auto before = std::prev(after);
  const double share = static_cast<double>(frame - before->first) / (after->first - before->first);
  return {found->setting, (1 - share) * before->second + share * after->second};
}

// Effects of each knob alone, in the frame nearest to the middle of the chapter at which stretches meet.
void Controller::readEffects(int index) {
  const int first = film_.first + index * kStretchesPerChapter * kLongest;
  const int last = std::min(first + kStretchesPerChapter * kLongest, film_.last);
  const int stretches = (last - first + kLongest - 1) / kLongest;
  const int middle = stretches > 1 ? first + stretches / 2 * kLongest : first + (last - first) / 2;
  int frame = middle;
  for (const int candidate : {middle, first, last}) {
    frame = candidate;
    if (!isBlack(probe(frame).full)) break;
  }
  const Costs full = measure(frame, held_).costs;
  chapter_ = {};
  chapter_.index = index;
  for (const auto& [stage, cost] : full) chapter_.stages.push_back(stage);
  for (const method::Option& knob : knobs_) {
    KnobEffects effects{{knob.sweep.front(), 0, std::vector<double>(full.size(), 1)}};
    for (const method::Value& value : knob.sweep | std::views::drop(1)) {
      method::Setting setting = held_;
      setting[knob.name] = value;
      const Measurement& found = measure(frame, setting);
      StepEffect effect{
          value, std::clamp(found.error * found.error, kLeastSquaredError, kMostSquaredError), {}};
      for (const auto& [stage, cost] : full)
        effect.ratios.push_back(cost > 0 ? costIn(found.costs, stage) / cost : 1);
      effects.push_back(std::move(effect));
      // Far beyond the tolerance already; further steps would not be chosen.
      if (target_.kind == Target::Kind::tolerance && found.error > 3 * target_.most) break;
    }
    if (effects.size() == 1) continue;
    chapter_.names.push_back(knob.name);
    chapter_.effects.push_back(std::move(effects));
  }
  if (target_.kind == Target::Kind::tolerance) readScatter(frame, first, last);
}

// Scatter of the error between neighbouring frames, with a setting that just meets the tolerance in the given
// frame; and how far below the tolerance measured frames must be, so that those between them meet it.
void Controller::readScatter(int frame, int first, int last) {
  FrameModel model = modelOf(frame);
  const auto steps = bestSteps(chapter_.effects, std::span(&model, 1),
                               {target_.most * target_.most, kInfinite}, Objective::cost);
  if (!steps) return;
  std::vector<double> logs;
  for (const int neighbour : {frame - 3, frame - 1, frame, frame + 1, frame + 3}) {
    if (neighbour < first || neighbour > last) continue;
    const double error = measure(neighbour, settingOf(*steps)).error;
    if (error > 0 && error < kInfinite) logs.push_back(std::log(error));
  }
  if (logs.size() < 2) return;
  const auto n = static_cast<double>(logs.size());
  const double mean = std::accumulate(logs.begin(), logs.end(), 0.0) / n;
  double squares = 0;
  for (const double log : logs) squares += (log - mean) * (log - mean);
  chapter_.scatter = std::sqrt(squares / (n - 1));
  chapter_.margin = std::min(1.0, kNearly * std::exp(-kOneSided * chapter_.scatter));
}

std::vector<Controller::Stretch> Controller::solve(int first, int last, Search& search) {
  std::vector<int> frames{first};
  if (last > first) frames.push_back(last);
  Steps best = bestFor(frames, search);
  if (last - first >= 2) {
    const int middle = first + (last - first) / 2;
    const Measurement atFirst = measure(first, settingOf(best)), atLast = measure(last, settingOf(best)),
                      inside = measure(middle, settingOf(best));
    search.known[middle].insert(best);
    const double mean = 0.5 * (atFirst.error + atLast.error);
    const bool isBent = target_.kind == Target::Kind::tolerance &&
                        std::abs(inside.error - mean) > kBend * target_.most + 2 * chapter_.scatter * mean;
    const bool fails = !meets(inside) && meets(atFirst) && meets(atLast);
    correct(chapter_.effects, best, std::min(inside.error * inside.error, kMostSquaredError),
            search.models.try_emplace(middle, modelOf(middle)).first->second);
    const bool isLong = last - first >= 2 * kShortest;
    if (isLong && (fails || isBent || isWorthDividing(first, middle, last, best, search))) {
      std::vector<Stretch> parts = solve(first, middle, search);
      std::ranges::move(solve(middle, last, search), std::back_inserter(parts));
      return parts;
    }
    frames.push_back(middle);
    bool isMet = !fails;
    const bool isFull = best == Steps(best.size(), 0);
    if (isLong && !isFull)
      for (const int quarter : {first + (middle - first) / 2, middle + (last - middle) / 2}) {
        frames.push_back(quarter);
        isMet = isMet && meets(measure(quarter, settingOf(best)));
      }
    if (!isMet) best = bestFor(frames, search);
  }
  Stretch stretch{first, last, settingOf(best), {}};
  for (const int frame : frames) stretch.errors[frame] = measure(frame, stretch.setting).error;
  return {stretch};
}

// Whether settings of their own promise to save the halves of a stretch more than choosing them costs.
bool Controller::isWorthDividing(int first, int middle, int last, const Steps& best,
                                 const Search& search) const {
  if (target_.kind != Target::Kind::tolerance || last - first < 2 * kShortest) return false;
  double saved = 0, full = 0;
  for (const auto& [from, to] : {std::pair(first, middle), std::pair(middle, last)}) {
    const std::array models{search.models.at(from), search.models.at(to)};
    const SearchLimits limits{tolerance() * tolerance(), kInfinite};
    const auto own = bestSteps(chapter_.effects, models, limits, Objective::cost);
    for (const FrameModel& model : models) {
      const double gain =
          cost(chapter_.effects, model, best) - cost(chapter_.effects, model, own.value_or(best));
      saved += 0.5 * (to - from) * gain;
      full = std::max(full, cost(chapter_.effects, model, Steps(best.size(), 0)));
    }
  }
  return saved > kDividing * full;
}

Steps Controller::bestFor(const std::vector<int>& frames, Search& search) {
  const bool byError = target_.kind == Target::Kind::tolerance;
  std::vector<FrameModel> models;
  for (const int frame : frames)
    models.push_back(search.models.try_emplace(frame, modelOf(frame)).first->second);
  const Steps full(chapter_.effects.size(), 0);
  std::vector<Steps> measured, failed;
  std::optional<Steps> best;
  double bestError = 0, bestCost = 0; // the largest over the frames

  // Measures a setting in all frames until it fails; the model learns.
  const auto judge = [&](const Steps& steps) {
    measured.push_back(steps);
    double error = 0, cost = 0;
    for (size_t i = 0; i < frames.size(); ++i) {
      const Measurement& found = measure(frames[i], settingOf(steps));
      search.known[frames[i]].insert(steps);
      const double square = std::min(found.error * found.error, kMostSquaredError);
      const bool isSurprise =
          found.error > kSurprise * std::sqrt(squaredError(chapter_.effects, models[i], steps));
      if (byError && isSurprise && !meets(found) && search.ownEffects.insert(frames[i]).second)
        measureOneByOne(frames[i], steps, models[i]);
      correct(chapter_.effects, steps, square, models[i]);
      if (!byError) {
        const double ratio = found.cost / control::cost(chapter_.effects, models[i], steps);
        for (double& stage : models[i].stageCosts) stage *= ratio;
      }
      search.models[frames[i]] = models[i];
      error = std::max(error, found.error);
      cost = std::max(cost, found.cost);
      if (!meets(found)) {
        failed.push_back(steps);
        return;
      }
    }
    const bool isBetter = !best || (byError ? cost < bestCost : error < bestError);
    if (!isBetter) return;
    best = steps;
    bestError = error;
    bestCost = cost;
  };
  const auto isExcluded = [&](const Steps& steps) {
    return std::ranges::find(measured, steps) != measured.end() ||
           std::ranges::any_of(failed, [&](const Steps& f) {
             return byError ? isAtLeastAsFast(steps, f) : isAtLeastAsFast(f, steps);
           });
  };

  judge(full);
  for (const Steps& steps : search.tried) { // in a longer stretch
    const auto isKnown = [&](int frame) { return search.known[frame].contains(steps); };
    if (steps != full && std::ranges::all_of(frames, isKnown)) judge(steps);
  }
  for (size_t tries = 0; tries < kMostTries; ++tries) {
    SearchLimits limits{kInfinite, kInfinite};
    if (byError) {
      limits.squaredError = tolerance() * tolerance();
      limits.cost = 0;
      for (const FrameModel& model : models)
        limits.cost = std::max(limits.cost, kGain * control::cost(chapter_.effects, model, *best));
    } else {
      limits.cost = target_.most;
      if (best && bestError == 0) break;
      if (best) limits.squaredError = kGain * kGain * bestError * bestError;
    }
    const auto next =
        bestSteps(chapter_.effects, models, limits, byError ? Objective::cost : Objective::error, isExcluded);
    if (!next) break;
    search.tried.push_back(*next);
    judge(*next);
  }
  if (best) return *best;
  return *bestSteps(chapter_.effects, models, {kInfinite, kInfinite}, Objective::cost); // out of reach
}

// Replaces the weights of the knobs that `steps` turns by what each of them alone does in this frame.
void Controller::measureOneByOne(int frame, const Steps& steps, FrameModel& model) {
  for (size_t k = 0; k < steps.size(); ++k) {
    if (steps[k] == 0) continue;
    Steps alone(steps.size(), 0);
    alone[k] = steps[k];
    const double error = measure(frame, settingOf(alone)).error;
    const double square = std::clamp(error * error, kLeastSquaredError, kMostSquaredError);
    model.weights[k] = square / chapter_.effects[k][steps[k]].squaredError;
  }
}

FrameModel Controller::modelOf(int frame) {
  FrameModel model{{}, std::vector<double>(chapter_.effects.size(), 1), 0};
  const Costs& costs = measure(frame, held_).costs;
  for (const std::string& stage : chapter_.stages) model.stageCosts.push_back(costIn(costs, stage));
  return model;
}

Controller::Probe& Controller::probe(int frame) {
  const auto [entry, isNew] = probed_.try_emplace(frame);
  Probe& probe = entry->second;
  if (isNew) probe.measured[held_] = rendered(frame, held_, probe);
  return probe;
}

const Controller::Measurement& Controller::measure(int frame, const method::Setting& setting) {
  Probe& probe = this->probe(frame);
  if (!probe.measured.contains(setting)) probe.measured[setting] = rendered(frame, setting, probe);
  return probe.measured.at(setting);
}

// Renders a frame; the first picture, at full, becomes the probe's.
Controller::Measurement Controller::rendered(int frame, const method::Setting& setting, Probe& probe) {
  renderer_.set(setting);
  const bool isFull = probe.full.values.empty();
  // The shorter of two times counts: the first frame may have had to wait for the disk.
  const int repeats = target_.kind == Target::Kind::tolerance ? 1 : 2;
  Measurement best{0, kInfinite, {}};
  for (int repeat = 0; repeat < repeats; ++repeat) {
    const Stopwatch watch;
    method::FrameLayers layers = render_(frame);
    ++probes_;
    const Costs costs = costsOf(layers.report, watch.seconds());
    if (!isFull) best.error = relativeRms(layers.color, probe.full);
    if (sum(costs) < best.cost) best = {best.error, sum(costs), costs};
    if (isFull && repeat + 1 == repeats) probe.full = std::move(layers.color);
  }
  return best;
}

// Costs by stage: estimated work, or milliseconds.
Controller::Costs Controller::costsOf(const method::FrameReport& report, double seconds) const {
  Costs costs;
  if (target_.kind == Target::Kind::tolerance) {
    constexpr std::string_view kGroup = "work.";
    for (const auto& [name, count] : report.counts)
      if (name.starts_with(kGroup)) costs[name.substr(kGroup.size())] = count;
    if (costs.empty()) throw Error("the renderer has knobs, but its frames report no work");
  } else {
    for (const auto& [stage, time] : report.seconds) costs[stage] = 1e3 * time;
    costs["other"] = std::max(0.0, 1e3 * seconds - sum(costs));
  }
  return costs;
}

method::Setting Controller::settingOf(const Steps& steps) const {
  method::Setting setting = held_;
  for (size_t k = 0; k < steps.size(); ++k)
    if (steps[k] > 0) setting[chapter_.names[k]] = chapter_.effects[k][steps[k]].value;
  return setting;
}

bool Controller::meets(const Measurement& measurement) const {
  return target_.kind == Target::Kind::tolerance ? measurement.error <= tolerance()
                                                 : measurement.cost <= target_.most;
}

} // namespace surflect::control
