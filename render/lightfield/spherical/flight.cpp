#include "render/lightfield/spherical/flight.h"

#include "surfel/base/time.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace surflect::spherical {

namespace {

constexpr double kGuessed = 2; // share of the budget that a guessed time may take
// Share of a finer mip level's time that a coarser one may take, or it is not worth its blur.
constexpr double kSaving = 0.8;

} // namespace

DetailControl::DetailControl(size_t levels, const ControlOptions& options)
    : finest_(3 * (static_cast<int>(levels) - 1)), options_(options) {
  isTried_.fill(std::vector<bool>(levels, false));
}

bool DetailControl::isTried(const Step& step) const {
  return isTried_[static_cast<size_t>(step.coarser)][static_cast<size_t>(step.thirds / 3)];
}

DetailControl::Step DetailControl::cheapest(int coarser, const Predicted& predicted) const {
  Step least{0, coarser};
  for (int whole = 3; whole <= finest_; whole += 3)
    if (const Step step{whole, coarser}; predicted(step.detail()) < predicted(least.detail())) least = step;
  return least;
}

DetailControl::Step DetailControl::retreat(const Fits& fits, const Predicted& predicted) const {
  for (int coarser = step_.coarser; coarser <= kMostCoarser; ++coarser) {
    const bool isPresent = coarser == step_.coarser;
    for (int thirds = isPresent ? step_.thirds - 1 : finest_; thirds >= 0; --thirds)
      if (const Step step{thirds, coarser}; fits(step)) return step;
    for (int whole = step_.thirds / 3 * 3 + 3; isPresent && whole <= finest_; whole += 3)
      if (const Step step{whole, coarser}; fits(step)) return step;
    // A coarser mip level shows by one level whether it is worth anything.
    const auto& tried = isTried_[static_cast<size_t>(coarser)];
    const auto untried = std::ranges::find(tried, false);
    if (coarser == 0 && untried != tried.end()) return {3 * static_cast<int>(untried - tried.begin()), 0};
    if (coarser > 0 && std::ranges::find(tried, true) == tried.end()) return cheapest(coarser, predicted);
  }
  Step least = cheapest(0, predicted);
  for (int coarser = 1; coarser <= kMostCoarser; ++coarser)
    if (const Step step = cheapest(coarser, predicted);
        predicted(step.detail()) < kSaving * predicted(least.detail()))
      least = step;
  return least;
}

std::optional<DetailControl::Step> DetailControl::advance(const Predicted& predicted) const {
  const auto fits = [&](const Step& step, double share) {
    return predicted(step.detail()) <= share * options_.budget;
  };
  for (int whole = finest_; step_.coarser > 0 && whole >= 0; whole -= 3)
    if (const Step sharper{whole, step_.coarser - 1}; fits(sharper, options_.headroom)) return sharper;
  const int whole = step_.thirds / 3 * 3 + 3;
  for (int next = step_.thirds + 1; next <= finest_; next = next / 3 * 3 + 3) { // a third, then whole levels
    const Step step{next, step_.coarser};
    const bool isGuess = next == whole && !isTried(step);
    if (fits(step, isGuess ? kGuessed : options_.headroom)) return step;
  }
  return std::nullopt;
}

Detail DetailControl::choose(const Predicted& predicted) {
  const auto fits = [&](const Step& step) { return predicted(step.detail()) <= options_.budget; };
  const std::optional<Step> before = std::exchange(before_, std::nullopt);
  if (before && predicted(step_.detail()) > options_.headroom * options_.budget && fits(*before)) {
    step_ = *before; // it was a wrong guess
    waiting_ = options_.patience;
  } else if (!fits(step_)) {
    step_ = retreat(fits, predicted);
    waiting_ = options_.patience;
  } else if (waiting_ > 0) {
    --waiting_;
  } else if (const std::optional<Step> next = advance(predicted)) {
    if (next->thirds % 3 == 0 && !isTried(*next)) before_ = step_;
    step_ = *next;
  }
  if (step_.thirds % 3 == 0)
    isTried_[static_cast<size_t>(step_.coarser)][static_cast<size_t>(step_.thirds / 3)] = true;
  return step_.detail();
}

OpenFlight::OpenFlight(const std::filesystem::path& folder, const CacheBudgets& budgets,
                       const FlightOptions& options, const Progress& progress)
    : folder_(folder, kFormat, kVersion, progress), file_(folder_), tree_(file_.shape().levels),
      context_(gl::contextOfThread()),
      slots_(slotsFor(file_.shape(), budgets, static_cast<size_t>(context_->describe().limits.arrayLayers))),
      frame_(tree_, file_.shape(), slots_.gpu, folder_.mesh()), loader_(file_),
      model_(tree_.levels(), measuredTimes(file_, frame_)), cache_(slots_, loader_, frame_),
      flight_(tree_, cache_, model_, options) {}

FrameTimes measuredTimes(const SphericalFile& file, SphericalFrame& frame) {
  constexpr double kLeast = 1e-6; // a clock's step
  const Stopwatch reading;
  const PencilImage image = file.read(0);
  FrameTimes times;
  times.disk = std::max(kLeast, reading.seconds());
  const gl::Stopwatch uploading;
  frame.upload(0, image); // into a slot that nothing has yet
  times.main = std::max(kLeast, uploading.seconds());
  return times;
}

FrameRecord OpenFlight::frame(const capture::Camera<AcquisitionSpace>& camera, const Look& look,
                              int samples) {
  const Stopwatch watch;
  return flight_.frame(windowOf(camera, shape().sphere), look,
                       {[&](const Look& chosen) { frame_.begin(camera, chosen, samples); },
                        [&](std::span<const TexturedTriangle> triangles) { frame_.add(triangles); },
                        [] { gl::finish(); }, [&] { return watch.seconds(); }});
}

Flight::Flight(const DirectionTree& tree, ImageCache& cache, FrameTimeModel& model,
               const FlightOptions& options)
    : tree_(tree), cache_(cache), model_(model), options_(options) {
  if (options.budget) control_.emplace(tree.levels(), ControlOptions{.budget = *options.budget});
}

Flight::Expected Flight::expected(const FramePlan& plan, const Detail& detail) const {
  Expected work{countsOf(plan, cache_), std::numeric_limits<size_t>::max()};
  if (options_.wait) return work;
  const size_t inMemory = work.counts.uploads - work.counts.reads;
  work.counts.reads = 0; // no frame waits for them
  work.counts.uploads = inMemory;
  if (!options_.budget) return work;
  // As many as fit into what is left, but always one: the field would never become finer otherwise.
  FrameCounts none = work.counts;
  none.uploads = 0;
  const double left = *options_.budget - model_.predict(none, detail), each = model_.times(detail).main;
  const double most = std::max(1.0, each > 0 ? left / each : static_cast<double>(inMemory));
  work.mostUploads = static_cast<size_t>(std::min(most, static_cast<double>(plan.images.size())));
  work.counts.uploads = std::min(inMemory, work.mostUploads);
  return work;
}

FrameRecord Flight::frame(const Window& window, Look look, const Canvas& canvas) {
  const double begin = canvas.clock();
  cache_.collect(false);
  std::map<double, FramePlan> plans; // by level
  const auto planAt = [&](double level) -> const FramePlan& {
    const auto [place, isNew] = plans.try_emplace(level);
    look.detail = level;
    if (isNew) place->second = planFrame(tree_, window, look);
    return place->second;
  };
  FrameRecord record;
  record.detail = {look.detail, 0};
  if (control_)
    record.detail = control_->choose([&](const Detail& detail) {
      return model_.predict(expected(planAt(detail.level), detail).counts, detail);
    });
  const FramePlan& plan = planAt(record.detail.level);
  look.detail = record.detail.level;
  look.coarser = record.detail.coarser;
  const Expected work = expected(plan, record.detail);
  record.predicted = model_.predict(work.counts, record.detail);
  canvas.begin(look);
  record.counts = options_.wait ? drawAll(plan, cache_, canvas.draw)
                                : drawAtHand(plan, cache_, work.mostUploads, canvas.draw);
  canvas.end();
  record.seconds = canvas.clock() - begin;
  model_.add(record.counts, record.detail, record.seconds);
  return record;
}

} // namespace surflect::spherical
