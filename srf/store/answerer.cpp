#include "srf/store/answerer.h"

#include "srf/store/asked_blocks.h"
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

constexpr size_t kOpsAtOnce = 32;      // that the processor fetches for while others are answered
constexpr size_t kOpsNamed = 256;      // whose blocks are found together
constexpr size_t kBlocksAtOnce = 4096; // that are fetched, or those of one part

// An operation, and the names of its blocks in the order of forEachBlock.
struct Placed {
  TexelPlace place;
  std::array<uint32_t, 4> blocks;
};

// Some operations whose blocks are all in memory.
struct Ready {
  struct Operation {
    uint32_t number;
    uint32_t jobsEnd;
  };
  std::array<Operation, kOpsAtOnce> operations;
  std::array<LookUpJob, 4 * kOpsAtOnce> jobs;
  uint32_t count = 0, jobCount = 0;

  void clear() { count = jobCount = 0; }
  // Asks the processor for the texels, too. Not a call: for the compiler it would have no effect, and be left
  // out.
  [[gnu::always_inline]] void add(const BlockTerms& block, const BlockTaps& taps) {
    const LookUpJob& job = jobs[jobCount++] = jobOf(block, taps);
    if (block.stride == 0) return;                                 // there are none
    const size_t last = 6 * static_cast<size_t>(block.stride) - 1; // of two that lie side by side
    for (const int8_t* upper : {job.levels, job.levels + job.down}) {
      __builtin_prefetch(upper);
      __builtin_prefetch(upper + last);
    }
  }
  void end(uint32_t number) { operations[count++] = {number, jobCount}; }
};

// Of an operation not all of whose blocks are in memory. Some are background, or it has to wait.
void prepareOther(AnsweredPart& part, uint32_t number, const Placed& placed, AskedBlocks& blocks,
                  Ready& ready) {
  const uint32_t* name = placed.blocks.data();
  const auto find = [&](BlockPosition) {
    AskedBlocks::Block& found = blocks[*name++];
    return found.state == AskedBlocks::State::background ? nullptr : &found;
  };
  ViewTaps<AskedBlocks::Block*> taps;
  findTaps(placed.place, find, taps);
  if (taps.empty()) {
    part.isLost[number] = true;
    ++part.lost;
    return;
  }
  if (std::ranges::any_of(taps,
                          [](const auto& of) { return of.block->state == AskedBlocks::State::onDisk; })) {
    part.waiting.push_back(number);
    for (const auto& of : taps)
      if (!std::exchange(of.block->isNeeded, true)) part.needed.push_back(of.block->key);
    return;
  }
  for (const auto& of : taps) {
    ready.add(of.block->terms, of.taps);
    part.taskRanks += static_cast<uint64_t>(of.block->terms.rank);
  }
  part.tasks += taps.size();
  ready.end(number);
}

inline void prepare(AnsweredPart& part, uint32_t number, const Placed& placed, AskedBlocks& blocks,
                    Ready& ready) {
  const uint32_t firstJob = ready.jobCount;
  const uint32_t* name = placed.blocks.data();
  bool isReady = true;
  uint64_t ranks = 0;
  forEachBlock(placed.place, [&](BlockPosition position) {
    const AskedBlocks::Block& block = blocks[*name++];
    isReady &= block.state == AskedBlocks::State::inMemory;
    ranks += static_cast<uint64_t>(block.terms.rank);
    ready.add(block.terms, placed.place.tapsIn(position));
  });
  if (!isReady) {
    ready.jobCount = firstJob;
    return prepareOther(part, number, placed, blocks, ready);
  }
  part.tasks += ready.jobCount - firstJob;
  part.taskRanks += ranks;
  ready.end(number);
}

// Those of one row together.
void answerReady(AnsweredPart& part, const Ready& ready, LookUpKernel lookUp) {
  std::array<float, 4 * 4 * kOpsAtOnce> rgb;
  uint32_t job = 0;
  for (uint32_t first = 0; first < ready.count;) {
    const ShadingOp& op = part.part.ops[ready.operations[first].number];
    uint32_t last = first;
    const auto sharesRow = [&](const ShadingOp& other) {
      return other.rowBegin == op.rowBegin && other.rowEnd == op.rowEnd;
    };
    while (last + 1 < ready.count && sharesRow(part.part.ops[ready.operations[last + 1].number])) ++last;
    lookUp(part.part.rows.data() + op.rowBegin, op.rowEnd - op.rowBegin, ready.jobs.data() + job,
           ready.operations[last].jobsEnd - job, rgb.data());
    const float* result = rgb.data();
    for (; first <= last; ++first) {
      const auto& [number, jobsEnd] = ready.operations[first];
      const float weight = part.part.ops[number].weight;
      Rgb& radiance = part.radiance[number];
      for (; job < jobsEnd; ++job, result += 4)
        radiance = radiance + weight * Rgb{result[0], result[1], result[2]};
    }
  }
}

} // namespace

// Some at a time: names their blocks and finds these; then, a few at a time, asks for the values of blocks
// that are new to the next few, and answers.
void Answerer::answerAll(AnsweredPart& part, size_t count, const auto& numberOf) const {
  AskedBlocks blocks(cache_);
  Ready ready;
  std::array<Placed, kOpsNamed> placed;
  std::array<size_t, kOpsNamed / kOpsAtOnce + 1>
      namedBy; // blocks, by the end of each few; the last once more
  for (size_t begin = 0; begin < count; begin += kOpsNamed) {
    const size_t end = std::min(count, begin + kOpsNamed);
    const auto forEachFew = [&](const auto& use) {
      for (size_t few = 0, first = begin; first < end; ++few, first += kOpsAtOnce)
        use(few, first, std::min(end, first + kOpsAtOnce));
    };
    forEachFew([&](size_t few, size_t first, size_t last) {
      for (size_t i = first; i < last; ++i) {
        const ShadingOp& op = part.part.ops[numberOf(i)];
        auto& [place, names] = placed[i - begin];
        place = TexelPlace::at(cache_.views()[op.view].header(), op.x, op.y);
        const auto row = part.part.rows.subspan(op.rowBegin, op.rowEnd - op.rowBegin);
        uint32_t* name = names.data();
        forEachBlock(place, [&](BlockPosition position) { *name++ = blocks.nameOf(op.view, position, row); });
      }
      namedBy[few] = namedBy[few + 1] = blocks.named();
    });
    blocks.findAll();
    blocks.fetchRest(namedBy[0]);
    forEachFew([&](size_t few, size_t first, size_t last) {
      ready.clear();
      for (size_t i = first; i < last; ++i) {
        prepare(part, numberOf(i), placed[i - begin], blocks, ready);
        blocks.fetchSome(namedBy[few + 1]);
      }
      blocks.fetchRest(namedBy[few + 1]);
      answerReady(part, ready, lookUp_);
    });
  }
}

void Answerer::answerResident(AnsweredPart& part) const {
  for (const ShadingOp& op : part.part.ops) part.lookups += op.rowEnd - op.rowBegin;
  answerAll(part, part.part.ops.size(), [](size_t i) { return static_cast<uint32_t>(i); });
}

void Answerer::answerWaiting(std::span<AnsweredPart> parts) const {
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) { std::ranges::sort(parts[p].needed); });
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
