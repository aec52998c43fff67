#include "render/lightfield/spherical/flight.h"

#include "surfel/base/time.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace surflect::spherical {

namespace {

constexpr double kGuessed = 2; // share of the budget that a guessed time may take

} // namespace

DetailControl::DetailControl(size_t levels, const ControlOptions& options)
    : finest_(3 * (static_cast<int>(levels) - 1)), options_(options), isTried_(levels, false) {}

int DetailControl::retreat(const std::function<bool(int thirds)>& fits,
                           const std::function<double(double detail)>& predicted) const {
  for (int coarser = thirds_ - 1; coarser >= 0; --coarser)
    if (fits(coarser)) return coarser;
  for (int finer = thirds_ / 3 * 3 + 3; finer <= finest_; finer += 3)
    if (fits(finer)) return finer;
  const auto untried = std::ranges::find(isTried_, false);
  if (untried != isTried_.end()) return 3 * static_cast<int>(untried - isTried_.begin());
  int least = 0;
  for (int whole = 3; whole <= finest_; whole += 3)
    if (predicted(whole / 3.0) < predicted(least / 3.0)) least = whole;
  return least;
}

double DetailControl::choose(const std::function<double(double detail)>& predicted) {
  const auto fits = [&](double share) {
    return [&, share](int thirds) { return predicted(thirds / 3.0) <= share * options_.budget; };
  };
  const std::optional<int> before = std::exchange(before_, std::nullopt);
  if (before && !fits(options_.headroom)(thirds_) && fits(1)(*before)) {
    thirds_ = *before; // it was a wrong guess
    waiting_ = options_.patience;
  } else if (!fits(1)(thirds_)) {
    thirds_ = retreat(fits(1), predicted);
    waiting_ = options_.patience;
  } else if (waiting_ > 0) {
    --waiting_;
  } else {
    const int whole = thirds_ / 3 * 3 + 3;
    for (int next = thirds_ + 1; next <= finest_; next = next / 3 * 3 + 3) { // a third, then whole levels
      const bool isGuess = next == whole && !isTried_[static_cast<size_t>(next / 3)];
      if (!fits(isGuess ? kGuessed : options_.headroom)(next)) continue;
      if (isGuess) before_ = thirds_;
      thirds_ = next;
      break;
    }
  }
  if (thirds_ % 3 == 0) isTried_[static_cast<size_t>(thirds_ / 3)] = true;
  return thirds_ / 3.0;
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

Flight::Expected Flight::expected(const FramePlan& plan, double detail) const {
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
  std::map<double, FramePlan> plans;
  const auto planAt = [&](double detail) -> const FramePlan& {
    const auto [place, isNew] = plans.try_emplace(detail);
    look.detail = detail;
    if (isNew) place->second = planFrame(tree_, window, look);
    return place->second;
  };
  FrameRecord record;
  record.detail = look.detail;
  if (control_)
    record.detail = control_->choose(
        [&](double detail) { return model_.predict(expected(planAt(detail), detail).counts, detail); });
  const FramePlan& plan = planAt(record.detail);
  look.detail = record.detail;
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
