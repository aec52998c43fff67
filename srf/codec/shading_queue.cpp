#include "srf/codec/shading_queue.h"

#include "srf/codec/view_taps.h"
#include "surfel/base/error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <limits>

namespace surflect::codec {

namespace {

// Operations of targets that see nothing but background: their numbers, ascending.
std::vector<uint32_t> blindOps(const AnsweredPart& answered) {
  if (answered.lost == 0) return {};
  const ShadingPart& part = answered.part;
  std::vector<uint8_t> sees(part.targets);
  for (size_t i = 0; i < part.ops.size(); ++i) sees[part.ops[i].target] |= !answered.isLost[i];
  std::vector<uint32_t> blind;
  for (uint32_t i = 0; i < part.ops.size(); ++i)
    if (!sees[part.ops[i].target]) blind.push_back(i);
  return blind;
}

// Moved to what their views store nearest.
std::vector<ShadingOp> sighted(std::span<const ShadingOp> ops, std::span<const uint32_t> blind,
                               std::span<const ViewFile> views) {
  std::vector<ShadingOp> moved;
  for (const uint32_t number : blind) {
    ShadingOp& op = moved.emplace_back(ops[number]);
    if (const auto stored = nearestStored(views[op.view], op.x, op.y)) op.x = stored->x, op.y = stored->y;
  }
  return moved;
}

// What remains of a target when some of its operations are lost.
struct SplatRaster {
  double all = 0, kept = 0; // sums of weights

  float scale() const { return all == kept || kept == 0 ? 1.f : static_cast<float>(all / kept); }
};

// Adds up a part's answers by target.
void sumUp(AnsweredPart& answered) {
  const auto& [ops, rows, targets] = answered.part;
  answered.sums.assign(targets, {});
  const auto add = [&](size_t i) {
    Rgb& sum = answered.sums[ops[i].target];
    const auto& [r, g, b, unused] = answered.radiance[i];
    sum = sum + ops[i].weight * Rgb{r, g, b};
  };
  if (answered.lost == 0) {
    for (size_t i = 0; i < ops.size(); ++i) add(i);
    return;
  }
  std::vector<SplatRaster> coverage(targets);
  for (size_t i = 0; i < ops.size(); ++i) {
    coverage[ops[i].target].all += ops[i].weight;
    if (answered.isLost[i]) continue;
    coverage[ops[i].target].kept += ops[i].weight;
    add(i);
  }
  for (size_t target = 0; target < targets; ++target)
    answered.sums[target] = coverage[target].scale() * answered.sums[target];
}

} // namespace

ShadingQueue::ShadingQueue(BlockCache& cache, ShadingStats& stats, const Progress& progress, Simd simd)
    : cache_(cache), stats_(stats), progress_(progress), answerer_(cache, simd, progress) {}

void ShadingQueue::begin(size_t parts) {
  count_ = parts;
  if (parts_.size() < parts) parts_.resize(parts);
  before_ = cache_.counts();
}

void ShadingQueue::ask(size_t number, const ShadingPart& part) {
  assert(number < count_);
  assert(std::ranges::all_of(part.ops, [&](const ShadingOp& op) {
    return op.view < cache_.views().size() && op.target < part.targets && op.rowBegin <= op.rowEnd &&
           op.rowEnd <= part.rows->lights.size();
  }));
  if (part.ops.size() > std::numeric_limits<uint32_t>::max())
    throw Error("too many look-ups to be queued at once");
  progress_.checkpoint();
  AnsweredPart& answered = parts_[number];
  answered.begin(part);
  answerer_.answerResident(answered);
  if (answered.waiting.empty() && answered.lost == 0) sumUp(answered); // while it is near the processor
}

std::vector<Rgb> ShadingQueue::finish() {
  const std::span parts(parts_.data(), count_);
  answerWaiting(parts);
  for (const AnsweredPart& answered : parts) {
    stats_.operations += answered.part.ops.size();
    stats_.lookups += answered.lookups;
    stats_.lost += answered.lost;
  }
  answerBlind();

  std::vector<size_t> first{0}; // target of each part; one more, for the end
  for (const AnsweredPart& answered : parts) first.push_back(first.back() + answered.part.targets);
  std::vector<Rgb> radiance(first.back());
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    if (parts[p].sums.empty()) sumUp(parts[p]);
    std::ranges::copy(parts[p].sums, radiance.begin() + static_cast<std::ptrdiff_t>(first[p]));
  });
  const CacheCounts after = cache_.counts();
  stats_.blocksRead += after.reads - before_.reads;
  stats_.bytesRead += after.bytesRead - before_.bytesRead;
  return radiance;
}

// What was not in memory.
void ShadingQueue::answerWaiting(std::span<AnsweredPart> parts) {
  uint64_t hits = 0;
  for (const AnsweredPart& answered : parts) hits += answered.tasks;
  answerer_.answerWaiting(parts);
  stats_.cacheHits += hits;
  for (const AnsweredPart& answered : parts) {
    stats_.tasks += answered.tasks;
    stats_.taskRanks += answered.taskRanks;
  }
}

// Answers once more the operations of targets that see nothing but background.
void ShadingQueue::answerBlind() {
  const std::span parts(parts_.data(), count_);
  std::vector<std::vector<uint32_t>> blind(count_); // numbers of operations
  std::vector<std::vector<ShadingOp>> moved(count_);
  tbb::parallel_for(size_t{0}, count_, [&](size_t p) {
    progress_.checkpoint();
    blind[p] = blindOps(parts[p]);
    moved[p] = sighted(parts[p].part.ops, blind[p], cache_.views());
  });
  if (std::ranges::all_of(blind, [](const auto& ops) { return ops.empty(); })) return;
  std::vector<AnsweredPart> again(count_);
  tbb::parallel_for(size_t{0}, count_, [&](size_t p) {
    again[p].begin({moved[p], parts[p].part.rows, parts[p].part.targets});
    answerer_.answerResident(again[p]);
  });
  answerWaiting(again);
  for (size_t p = 0; p < count_; ++p)
    for (size_t i = 0; i < blind[p].size(); ++i) {
      parts[p].radiance[blind[p][i]] = again[p].radiance[i];
      parts[p].isLost[blind[p][i]] = again[p].isLost[i];
    }
}

std::vector<Rgb> execute(std::span<const ShadingPart> parts, BlockCache& cache, ShadingStats& stats,
                         const Progress& progress, Simd simd) {
  ShadingQueue queue(cache, stats, progress, simd);
  queue.begin(parts.size());
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) { queue.ask(p, parts[p]); });
  return queue.finish();
}

} // namespace surflect::codec
