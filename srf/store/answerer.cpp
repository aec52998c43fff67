#include "srf/store/answerer.h"

#include "srf/store/recent_blocks.h"
#include "srf/store/view_taps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <iterator>
#include <utility>

namespace surflect {

namespace {

constexpr size_t kOpsAtOnce = 32; // that the processor fetches for while others are answered
constexpr size_t kMostJobs = 4 * kOpsAtOnce;
constexpr size_t kBlocksAtOnce = 4096; // that are fetched, or those of one part

// An operation, and where its answer goes.
struct Asked {
  const ShadingOp* op;
  const LightWeight* row;
  Rgb* radiance;

  Asked() = default;
  Asked(AnsweredPart& part, size_t i)
      : op(&part.part.ops[i]), row(part.part.rows.data() + op->rowBegin), radiance(&part.radiance[i]) {}
  size_t lights() const { return op->rowEnd - op->rowBegin; }
};

// Asks the processor for texels that a look-up will read. Not a call: for the compiler it would have no
// effect, and be left out.
[[gnu::always_inline]] inline void fetchTexels(const BlockTerms& block, const BlockTaps& taps) {
  if (block.rank == 0) return;
  const auto texelBytes = 3 * static_cast<size_t>(block.stride);
  for (const size_t left : {0, 2}) { // two that most often lie side by side
    __builtin_prefetch(block.texel(taps.texels[left]));
    __builtin_prefetch(block.texel(taps.texels[left + 1]) + texelBytes - 1);
  }
}

void add(const Asked& asked, const float* rgb) {
  *asked.radiance = *asked.radiance + asked.op->weight * Rgb{rgb[0], rgb[1], rgb[2]};
}

} // namespace

// Some operations whose blocks are all in memory.
struct Answerer::Ready {
  struct Operation {
    Asked asked;
    size_t firstJob;
    ViewTaps<RecentBlocks::Found*> taps;
  };
  std::array<Operation, kOpsAtOnce> operations;
  std::array<LookUpJob, kMostJobs> jobs;
  size_t count = 0, jobCount = 0;
  RecentBlocks blocks;

  explicit Ready(const BlockCache& cache) : blocks(cache) {}

  void clear() { count = jobCount = 0; }
  [[gnu::always_inline]] void add(const BlockTerms& block, const BlockTaps& taps) {
    fetchTexels(block, taps);
    jobs[jobCount++] = {block.levels, block.coefficients, static_cast<size_t>(block.stride), &taps};
  }
  size_t jobsEnd(size_t i) const { return i + 1 < count ? operations[i + 1].firstJob : jobCount; }
};

// A few at a time: finds their blocks and asks the processor for them; then answers, those of one row
// together.
void Answerer::answerAll(AnsweredPart& part, size_t count, const auto& numberOf) const {
  Ready ready(cache_);
  for (size_t begin = 0; begin < count; begin += kOpsAtOnce) {
    ready.clear();
    for (size_t i = begin; i < std::min(count, begin + kOpsAtOnce); ++i) prepare(part, numberOf(i), ready);
    ready.blocks.fetchRest();
    answerReady(ready);
  }
}

void Answerer::answerResident(AnsweredPart& part) const {
  for (const ShadingOp& op : part.part.ops) part.lookups += op.rowEnd - op.rowBegin;
  answerAll(part, part.part.ops.size(), [](size_t i) { return static_cast<uint32_t>(i); });
}

void Answerer::prepare(AnsweredPart& part, uint32_t i, Ready& ready) const {
  const ShadingOp& op = part.part.ops[i];
  auto& [asked, firstJob, taps] = ready.operations[ready.count];
  const auto find = [&](BlockPosition position) {
    RecentBlocks::Found& found = ready.blocks.at(op.view, position);
    return found.isStored ? &found : nullptr;
  };
  findTaps(TexelPlace::at(cache_.views()[op.view].header(), op.x, op.y), find, taps);
  ready.blocks.fetchSome();
  if (taps.empty()) {
    part.isLost[i] = true;
    ++part.lost;
    return;
  }
  if (!std::ranges::all_of(taps, [](const auto& placed) { return placed.block->terms.has_value(); })) {
    part.waiting.push_back(i);
    for (const auto& placed : taps)
      if (!std::exchange(placed.block->isNeeded, true))
        part.needed.push_back({op.view, placed.block->number});
    return;
  }
  asked = Asked(part, i);
  firstJob = ready.jobCount;
  ++ready.count;
  for (const auto& placed : taps) {
    ready.add(*placed.block->terms, placed.taps);
    part.taskRanks += static_cast<uint64_t>(placed.block->terms->rank);
  }
  part.tasks += taps.size();
}

void Answerer::answerReady(const Ready& ready) const {
  std::array<float, 3 * kMostJobs> rgb;
  for (size_t first = 0; first < ready.count;) {
    const auto& [asked, firstJob, taps] = ready.operations[first];
    const auto sharesRow = [&](const Asked& other) {
      return other.row == asked.row && other.lights() == asked.lights();
    };
    size_t last = first;
    while (last + 1 < ready.count && sharesRow(ready.operations[last + 1].asked)) ++last;
    lookUp_(asked.row, asked.lights(), ready.jobs.data() + firstJob, ready.jobsEnd(last) - firstJob,
            rgb.data());
    const float* result = rgb.data();
    for (; first <= last; ++first)
      for (size_t job = ready.operations[first].firstJob; job < ready.jobsEnd(first); ++job, result += 3)
        add(ready.operations[first].asked, result);
  }
}

void Answerer::answerWaiting(std::span<AnsweredPart> parts) const {
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    std::ranges::sort(parts[p].needed);
    const auto twice = std::ranges::unique(parts[p].needed);
    parts[p].needed.erase(twice.begin(), twice.end());
  });
  std::vector<BlockKey> blocks, more;
  for (size_t begin = 0, end = 0; begin < parts.size(); begin = end) {
    blocks = parts[end++].needed;
    for (; end < parts.size(); ++end) {
      more.clear();
      std::ranges::set_union(blocks, parts[end].needed, std::back_inserter(more));
      if (more.size() > kBlocksAtOnce) break;
      blocks.swap(more);
    }
    if (!blocks.empty()) answerFetched(parts.subspan(begin, end - begin), blocks);
  }
}

void Answerer::answerFetched(std::span<AnsweredPart> parts, std::span<const BlockKey> blocks) const {
  struct Trim {
    BlockCache& cache;
    ~Trim() { cache.trim(); }
  } const trim{cache_};
  cache_.fetch(blocks, progress_);
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    progress_.checkpoint();
    const std::vector<uint32_t> waiting = std::exchange(parts[p].waiting, {});
    answerAll(parts[p], waiting.size(), [&](size_t i) { return waiting[i]; });
    assert(parts[p].waiting.empty());
  });
}

} // namespace surflect
