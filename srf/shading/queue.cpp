#include "srf/shading/queue.h"

#include "srf/shading/taps.h"
#include "surfel/base/error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <limits>

namespace surflect::shading {

namespace {

// Blind operations: those of targets whose operations all see only background. Returns their indices,
// ascending.
std::vector<uint32_t> lostTargetOps(const ExecutedPart& executed) {
  if (executed.lost == 0) return {};
  const ShadingPart& part = executed.part;
  std::vector<uint8_t> sees(part.targets);
  for (size_t i = 0; i < part.ops.size(); ++i) sees[part.ops[i].target] |= !executed.isLost[i];
  std::vector<uint32_t> blind;
  for (uint32_t i = 0; i < part.ops.size(); ++i)
    if (!sees[part.ops[i].target]) blind.push_back(i);
  return blind;
}

// The blind operations, each moved to the nearest texel that its view stores.
std::vector<ShadingOp> movedToStoredTexels(std::span<const ShadingOp> ops, std::span<const uint32_t> blind,
                                           std::span<const codec::ViewFile> views) {
  std::vector<ShadingOp> moved;
  for (const uint32_t number : blind) {
    ShadingOp& op = moved.emplace_back(ops[number]);
    if (const auto stored = nearestStored(views[op.view], op.x, op.y)) op.x = stored->x, op.y = stored->y;
  }
  return moved;
}

// Sums of a target's weights, over all operations and over those not lost.
struct WeightSums {
  double all = 0, kept = 0;

  float scale() const { return all == kept || kept == 0 ? 1.f : static_cast<float>(all / kept); }
};

// Brings the radiance of a part's operations to their slots.
void keep(const ExecutedPart& executed) {
  for (const auto& [op, slot] : executed.part.asked)
    if (!executed.isLost[op])
      executed.part.kept->set(slot,
                              {executed.radiance[op][0], executed.radiance[op][1], executed.radiance[op][2]});
}

// Sums the radiance of a part's operations by target.
void sumUp(ExecutedPart& executed) {
  const std::span<const ShadingOp> ops = executed.part.ops;
  const size_t targets = executed.part.targets;
  executed.sums.assign(targets, {});
  const auto add = [&](size_t i) {
    Rgb& sum = executed.sums[ops[i].target];
    const auto& [r, g, b, unused] = executed.radiance[i];
    sum = sum + ops[i].weight * Rgb{r, g, b};
  };
  if (executed.lost == 0) {
    for (size_t i = 0; i < ops.size(); ++i) add(i);
    return;
  }
  std::vector<WeightSums> weights(targets);
  for (size_t i = 0; i < ops.size(); ++i) {
    weights[ops[i].target].all += ops[i].weight;
    if (executed.isLost[i]) continue;
    weights[ops[i].target].kept += ops[i].weight;
    add(i);
  }
  for (size_t target = 0; target < targets; ++target)
    executed.sums[target] = weights[target].scale() * executed.sums[target];
}

} // namespace

ShadingQueue::ShadingQueue(codec::BlockCache& cache, ShadingStats& stats, const Progress& progress)
    : cache_(cache), stats_(stats), progress_(progress), executor_(cache, progress) {}

void ShadingQueue::begin(size_t parts) {
  count_ = parts;
  if (parts_.size() < parts) parts_.resize(parts);
  before_ = cache_.counts();
}

void ShadingQueue::emit(size_t number, const ShadingPart& part) {
  assert(number < count_);
  assert(std::ranges::all_of(part.ops, [&](const ShadingOp& op) {
    return op.view < cache_.views().size() && op.target < part.targets && op.rowBegin <= op.rowEnd &&
           op.rowEnd <= part.rows->lights.size();
  }));
  if (part.ops.size() > std::numeric_limits<uint32_t>::max())
    throw Error("too many look-ups to be queued at once");
  progress_.checkpoint();
  ExecutedPart& executed = parts_[number];
  executed.begin(part);
  executor_.executeResident(executed);
  // Sums up at once, while the part is in the processor's cache.
  if (executed.waiting.empty() && executed.lost == 0) sumUp(executed);
}

std::vector<Rgb> ShadingQueue::finish() {
  const std::span parts(parts_.data(), count_);
  executeWaiting(parts);
  for (const ExecutedPart& executed : parts) {
    stats_.operations += executed.part.ops.size() - executed.part.known.size();
    stats_.lookups += executed.lookups;
    stats_.lost += executed.lost;
  }
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) { keep(parts[p]); });
  retryLostTargets();

  std::vector<size_t> first{0}; // first target of each part, then the end
  for (const ExecutedPart& executed : parts) first.push_back(first.back() + executed.part.targets);
  std::vector<Rgb> radiance(first.back());
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    if (parts[p].sums.empty()) sumUp(parts[p]);
    std::ranges::copy(parts[p].sums, radiance.begin() + static_cast<std::ptrdiff_t>(first[p]));
  });
  const codec::CacheCounts after = cache_.counts();
  stats_.blocksRead += after.reads - before_.reads;
  stats_.bytesRead += after.bytesRead - before_.bytesRead;
  return radiance;
}

// Counts cache hits, then executes the waiting operations.
void ShadingQueue::executeWaiting(std::span<ExecutedPart> parts) {
  uint64_t hits = 0;
  for (const ExecutedPart& executed : parts) hits += executed.tasks;
  executor_.executeWaiting(parts);
  stats_.cacheHits += hits;
  for (const ExecutedPart& executed : parts) {
    stats_.tasks += executed.tasks;
    stats_.taskRanks += executed.taskRanks;
  }
}

// Repeats the operations of targets that see only background, at the nearest stored texels.
void ShadingQueue::retryLostTargets() {
  const std::span parts(parts_.data(), count_);
  std::vector<std::vector<uint32_t>> blind(count_); // operation numbers, by part
  std::vector<std::vector<ShadingOp>> moved(count_);
  tbb::parallel_for(size_t{0}, count_, [&](size_t p) {
    progress_.checkpoint();
    blind[p] = lostTargetOps(parts[p]);
    moved[p] = movedToStoredTexels(parts[p].part.ops, blind[p], cache_.views());
  });
  if (std::ranges::all_of(blind, [](const auto& ops) { return ops.empty(); })) return;
  std::vector<ExecutedPart> again(count_);
  tbb::parallel_for(size_t{0}, count_, [&](size_t p) {
    again[p].begin({moved[p], parts[p].part.rows, parts[p].part.targets});
    executor_.executeResident(again[p]);
  });
  executeWaiting(again);
  for (size_t p = 0; p < count_; ++p)
    for (size_t i = 0; i < blind[p].size(); ++i) {
      parts[p].radiance[blind[p][i]] = again[p].radiance[i];
      parts[p].isLost[blind[p][i]] = again[p].isLost[i];
    }
}

std::vector<Rgb> execute(std::span<const ShadingPart> parts, codec::BlockCache& cache, ShadingStats& stats,
                         const Progress& progress) {
  ShadingQueue queue(cache, stats, progress);
  queue.begin(parts.size());
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) { queue.emit(p, parts[p]); });
  return queue.finish();
}

} // namespace surflect::shading
