#include "render/lightfield/spherical/flight.h"

#include <algorithm>
#include <limits>
#include <map>

namespace surflect::spherical {

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
