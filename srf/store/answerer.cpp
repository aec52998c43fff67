#include "srf/store/answerer.h"

#include "srf/store/view_taps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

namespace surflect {

namespace {

constexpr size_t kOpsAtOnce = 32;      // that the processor fetches for while others are answered
constexpr size_t kBlocksAtOnce = 4096; // that are fetched, or those of one part

// Tells keys apart that come again soon: a table in which later ones take the places of others.
class Lately {
public:
  // Has the key not come lately?
  bool isNew(uint64_t key) {
    uint64_t& held = held_[key * kGolden >> (64 - kBits)];
    return std::exchange(held, key + 1) != key + 1;
  }

private:
  static constexpr int kBits = 9;                         // a part's blocks are some hundred and fifty
  static constexpr uint64_t kGolden = 0x9e3779b97f4a7c15; // 2^64 over the golden ratio
  std::array<uint64_t, size_t{1} << kBits> held_{};       // keys + 1
};

// An operation, and where its blocks are, in the order of forEachBlock.
struct Placed {
  TexelPlace place;
  std::array<uint32_t, 4> blocks; // as BlockCache::Grid has them
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

// A block of a view, and where it is.
struct Found {
  BlockPosition position;
  uint32_t place;
};

// Makes operations ready whose blocks are all in memory, and notes what others wait for.
class Preparer {
public:
  Preparer(const BlockCache& cache, AnsweredPart& part) : cache_(cache), part_(part) {}

  // Finds out where the blocks of an operation are, and has the processor fetch what is known of them.
  [[gnu::always_inline]] void place(const ShadingOp& op, Placed& placed) const {
    const BlockCache::Grid& grid = cache_.grid(op.view);
    placed.place = TexelPlace::at(grid.header, op.x, op.y);
    uint32_t* next = placed.blocks.data();
    forEachBlock(placed.place, [&](BlockPosition position) {
      const uint32_t block = *next++ = grid.placeOf(position);
      if (BlockCache::isInMemory(block)) cache_.fetchResident(block);
    });
  }

  [[gnu::always_inline]] void prepare(uint32_t number, const Placed& placed, Ready& ready) {
    const ShadingOp& op = part_.part.ops[number];
    const uint32_t block = placed.blocks[0];
    if (!placed.place.isInOneBlock() || !BlockCache::isInMemory(block))
      return prepareOther(number, placed, ready);
    ++part_.tasks;
    part_.taskRanks += add(block, op, placed.place.tapsInOneBlock(), ready);
    ready.end(number);
  }

private:
  // Returns the rank of the block.
  [[gnu::always_inline]] uint64_t add(uint32_t block, const ShadingOp& op, const BlockTaps& taps,
                                      Ready& ready) {
    const BlockTerms terms = cache_.resident(block).terms(cache_.grid(op.view).header);
    ready.add(terms, taps);
    if (lately_.isNew(block)) fetchLights(terms, op);
    return static_cast<uint64_t>(terms.rank);
  }

  // Neighbours have nearly the same lights.
  [[gnu::always_inline]] void fetchLights(const BlockTerms& terms, const ShadingOp& op) const {
    for (const LightWeight& of : part_.part.rows->weightsOf(op.rowBegin, op.rowEnd))
      __builtin_prefetch(terms.light(of.light));
  }

  // In several blocks, or one that is not in memory: it is background, or has to be waited for.
  void prepareOther(uint32_t number, const Placed& placed, Ready& ready) {
    const ShadingOp& op = part_.part.ops[number];
    const uint32_t* next = placed.blocks.data();
    const auto find = [&](BlockPosition position) {
      const uint32_t place = *next++;
      return place == BlockCache::kBackground ? std::nullopt : std::optional<Found>({position, place});
    };
    ViewTaps<std::optional<Found>> taps;
    findTaps(placed.place, find, taps);
    if (taps.empty()) {
      part_.isLost[number] = true;
      ++part_.lost;
      return;
    }
    if (std::ranges::any_of(taps, [](const auto& of) { return of.block->place == BlockCache::kOnDisk; })) {
      part_.waiting.push_back(number);
      for (const auto& of : taps) need(op.view, of.block->position);
      return;
    }
    for (const auto& of : taps) part_.taskRanks += add(of.block->place, op, of.taps, ready);
    part_.tasks += taps.size();
    ready.end(number);
  }

  void need(uint32_t view, BlockPosition position) {
    const uint32_t block = *cache_.views()[view].find(position);
    if (neededLately_.isNew(uint64_t{view} << 32 | block)) part_.needed.push_back({view, block});
  }

  const BlockCache& cache_;
  AnsweredPart& part_;
  Lately lately_;       // places of blocks whose coefficients were asked of memory
  Lately neededLately_; // blocks that were noted
};

// Those of one row together.
void answerReady(AnsweredPart& part, const Ready& ready, LookUpKernel lookUp) {
  const LightRows& rows = *part.part.rows;
  std::array<float, 4 * 4 * kOpsAtOnce> rgb;
  uint32_t job = 0;
  for (uint32_t first = 0; first < ready.count;) {
    const ShadingOp& op = part.part.ops[ready.operations[first].number];
    uint32_t last = first;
    const auto sharesRow = [&](const ShadingOp& other) {
      return other.rowBegin == op.rowBegin && other.rowEnd == op.rowEnd;
    };
    while (last + 1 < ready.count && sharesRow(part.part.ops[ready.operations[last + 1].number])) ++last;
    lookUp(rows.lights.data() + op.rowBegin, op.rowEnd - op.rowBegin, rows.weights.data(),
           ready.jobs.data() + job, ready.operations[last].jobsEnd - job, rgb.data());
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

// Some at a time: while these are answered, memory brings what the next need.
void Answerer::answerAll(AnsweredPart& part, size_t count, const auto& numberOf) const {
  Preparer preparer(cache_, part);
  std::array<Placed, kOpsAtOnce> placed;
  std::array<Ready, 2> ready;
  Ready *now = &ready[0], *next = &ready[1]; // what is answered, and what comes after that
  for (size_t begin = 0; begin < count; begin += kOpsAtOnce) {
    const size_t some = std::min(kOpsAtOnce, count - begin);
    for (size_t i = 0; i < some; ++i) preparer.place(part.part.ops[numberOf(begin + i)], placed[i]);
    next->clear();
    for (size_t i = 0; i < some; ++i) preparer.prepare(numberOf(begin + i), placed[i], *next);
    answerReady(part, *now, lookUp_);
    std::swap(now, next);
  }
  answerReady(part, *now, lookUp_);
}

void Answerer::answerResident(AnsweredPart& part) const {
  for (const ShadingOp& op : part.part.ops)
    part.lookups += part.part.rows->weightsOf(op.rowBegin, op.rowEnd).size();
  answerAll(part, part.part.ops.size(), [](size_t i) { return static_cast<uint32_t>(i); });
}

void Answerer::answerWaiting(std::span<AnsweredPart> parts) const {
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    std::vector<BlockKey>& needed = parts[p].needed;
    std::ranges::sort(needed);
    needed.erase(std::ranges::unique(needed).begin(), needed.end());
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
