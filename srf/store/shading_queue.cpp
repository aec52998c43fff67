#include "srf/store/shading_queue.h"

#include "srf/store/answerer.h"
#include "srf/store/view_taps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>

namespace surflect {

namespace {

// Operations of targets that see nothing but background: their numbers, ascending.
std::vector<uint32_t> blindOps(const ShadingPart& part, std::span<const uint8_t> isLost) {
  if (std::ranges::count(isLost, true) == 0) return {};
  std::vector<uint8_t> sees(part.targets);
  for (size_t i = 0; i < part.ops.size(); ++i) sees[part.ops[i].target] |= !isLost[i];
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

// Answers once more the operations of targets that see nothing but background.
void answerBlind(const Answerer& answerer, std::span<const ShadingPart> parts,
                 std::span<const ViewFile> views, const Progress& progress, Answered& answered) {
  std::vector<std::vector<uint32_t>> blind(parts.size()); // numbers of operations
  std::vector<std::vector<ShadingOp>> moved(parts.size());
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    progress.checkpoint();
    blind[p] = blindOps(parts[p], answered.parts[p].isLost);
    moved[p] = sighted(parts[p].ops, blind[p], views);
  });
  if (std::ranges::all_of(blind, [](const auto& ops) { return ops.empty(); })) return;
  std::vector<ShadingPart> again;
  for (size_t p = 0; p < parts.size(); ++p) again.push_back({moved[p], parts[p].rows, parts[p].targets});
  const Answered nearest = answerer.answer(again);
  for (size_t p = 0; p < parts.size(); ++p)
    for (size_t i = 0; i < blind[p].size(); ++i) {
      answered.parts[p].radiance[blind[p][i]] = nearest.parts[p].radiance[i];
      answered.parts[p].isLost[blind[p][i]] = nearest.parts[p].isLost[i];
    }
  answered.tasks += nearest.tasks;
  answered.ranks += nearest.ranks;
  answered.hits += nearest.hits;
}

// What remains of a target when some of its operations are lost.
struct Coverage {
  double all = 0, kept = 0; // sums of weights

  float scale() const { return all == kept || kept == 0 ? 1.f : static_cast<float>(all / kept); }
};

// Adds up a part's answers by target.
void sum(const ShadingPart& part, const Answers& answers, std::span<Rgb> radiance) {
  std::vector<Coverage> coverage(part.targets);
  for (size_t i = 0; i < part.ops.size(); ++i) {
    const ShadingOp& op = part.ops[i];
    coverage[op.target].all += op.weight;
    if (answers.isLost[i]) continue;
    coverage[op.target].kept += op.weight;
    radiance[op.target] = radiance[op.target] + answers.radiance[i];
  }
  for (size_t target = 0; target < part.targets; ++target)
    radiance[target] = coverage[target].scale() * radiance[target];
}

} // namespace

std::vector<Rgb> execute(std::span<const ShadingPart> parts, BlockCache& cache, ShadingStats& stats,
                         const Progress& progress, Simd simd) {
  const std::span<const ViewFile> views = cache.views();
  assert(std::ranges::all_of(parts, [&](const ShadingPart& part) {
    return std::ranges::all_of(part.ops, [&](const ShadingOp& op) {
      return op.view < views.size() && op.target < part.targets && op.rowBegin <= op.rowEnd &&
             op.rowEnd <= part.rows.size();
    });
  }));
  const CacheCounts before = cache.counts();
  const Answerer answerer(cache, simd, progress);
  Answered answered = answerer.answer(parts);
  for (const Answers& answers : answered.parts)
    stats.lost += static_cast<uint64_t>(std::ranges::count(answers.isLost, true));
  answerBlind(answerer, parts, views, progress, answered);

  std::vector<size_t> first{0}; // target of each part; one more, for the end
  for (const ShadingPart& part : parts) first.push_back(first.back() + part.targets);
  std::vector<Rgb> radiance(first.back());
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    sum(parts[p], answered.parts[p], std::span(radiance).subspan(first[p], parts[p].targets));
  });

  for (const ShadingPart& part : parts) {
    stats.operations += part.ops.size();
    for (const ShadingOp& op : part.ops) stats.lookups += op.rowEnd - op.rowBegin;
  }
  const CacheCounts after = cache.counts();
  stats.tasks += answered.tasks;
  stats.taskRanks += answered.ranks;
  stats.blocksRead += after.reads - before.reads;
  stats.bytesRead += after.bytesRead - before.bytesRead;
  stats.cacheHits += answered.hits;
  return radiance;
}

} // namespace surflect
