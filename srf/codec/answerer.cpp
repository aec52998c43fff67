#include "srf/codec/answerer.h"

#include "srf/codec/view_taps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

namespace surflect::codec {

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
  bool areInMemory;               // all of its blocks
  bool isWaiting;                 // for one of them
  std::array<uint32_t, 4> blocks; // as BlockCache::Grid has them
};

// Look-ups in blocks that are in memory, by the rows of their operations.
struct Ready {
  struct Group {
    uint32_t rowBegin, rowEnd;
    uint32_t jobsEnd;
  };
  std::array<Group, kOpsAtOnce> groups;
  std::array<LookUpJob, 4 * kOpsAtOnce> jobs;
  uint32_t groupCount = 0, jobCount = 0;

  void clear() { groupCount = jobCount = 0; }
  // Asks the processor for the texels, too. Not a call: for the compiler it would have no effect, and be left
  // out.
  [[gnu::always_inline]] void add(const BlockTerms& block, const BlockTaps& taps, float* rgb) {
    const LookUpJob& job = jobs[jobCount++] = jobOf(block, taps, rgb);
    const size_t last = 6 * static_cast<size_t>(block.stride) - 1; // of two that lie side by side
    for (const int8_t* upper : {job.levels, job.levels + job.down}) {
      __builtin_prefetch(upper);
      __builtin_prefetch(upper + last);
    }
  }
  // The jobs of an operation are there.
  void end(const ShadingOp& op) {
    const bool sharesRow = groupCount > 0 && groups[groupCount - 1].rowBegin == op.rowBegin &&
                           groups[groupCount - 1].rowEnd == op.rowEnd;
    if (!sharesRow) ++groupCount;
    groups[groupCount - 1] = {op.rowBegin, op.rowEnd, jobCount};
  }
};

// Makes operations ready whose blocks are all in memory, and notes what others wait for.
class Preparer {
public:
  Preparer(const BlockCache& cache, AnsweredPart& part) : cache_(cache), part_(part) {}

  // Finds out where the blocks of an operation are, and has the processor fetch what is known of them.
  [[gnu::always_inline]] void place(const ShadingOp& op, Placed& placed) const {
    const BlockCache::Grid& grid = cache_.grid(op.view);
    placed.place = TexelPlace::at(grid.header, op.x, op.y);
    placed.areInMemory = true;
    placed.isWaiting = false;
    uint32_t* next = placed.blocks.data();
    forEachBlock(placed.place, [&](BlockPosition position) {
      const uint32_t block = *next++ = grid.placeOf(position);
      const bool isInMemory = BlockCache::isInMemory(block);
      placed.areInMemory &= isInMemory;
      placed.isWaiting |= block == BlockCache::kOnDisk;
      if (isInMemory) cache_.fetchResident(block);
    });
  }

  [[gnu::always_inline]] void prepare(uint32_t number, const Placed& placed, Ready& ready) {
    if (placed.isWaiting) return wait(number, placed);
    if (!placed.areInMemory) return prepareOther(number, placed, ready);
    const uint32_t* next = placed.blocks.data();
    if (placed.place.isInOneBlock())
      add(number, *next, placed.place.tapsInOneBlock(), ready);
    else
      forEachBlock(placed.place, [&](BlockPosition position) {
        add(number, *next++, placed.place.tapsIn(position), ready);
      });
    ready.end(part_.part.ops[number]);
  }

private:
  [[gnu::always_inline]] void add(uint32_t number, uint32_t block, const BlockTaps& taps, Ready& ready) {
    const ShadingOp& op = part_.part.ops[number];
    const BlockTerms terms = cache_.resident(block).terms(cache_.grid(op.view).header);
    ++part_.tasks;
    part_.taskRanks += static_cast<uint64_t>(terms.rank);
    if (terms.rank == 0) return;
    ready.add(terms, taps, part_.radiance[number].data());
    if (lately_.isNew(block)) fetchLights(terms, op);
  }

  // Neighbours have nearly the same lights.
  [[gnu::always_inline]] void fetchLights(const BlockTerms& terms, const ShadingOp& op) const {
    for (const LightWeight& of : part_.part.rows->weightsOf(op.rowBegin, op.rowEnd))
      __builtin_prefetch(terms.light(of.light));
  }

  // Notes all its blocks, so that those in memory stay there.
  void wait(uint32_t number, const Placed& placed) {
    const uint32_t view = part_.part.ops[number].view;
    part_.waiting.push_back(number);
    const uint32_t* next = placed.blocks.data();
    forEachBlock(placed.place, [&](BlockPosition position) {
      if (*next++ != BlockCache::kBackground) need(view, position);
    });
  }

  // Some of its blocks are background.
  void prepareOther(uint32_t number, const Placed& placed, Ready& ready) {
    const uint32_t* next = placed.blocks.data();
    const auto find = [&](BlockPosition) {
      const uint32_t place = *next++;
      return place == BlockCache::kBackground ? std::nullopt : std::optional(place);
    };
    ViewTaps<std::optional<uint32_t>> taps;
    findTaps(placed.place, find, taps);
    if (taps.empty()) {
      part_.isLost[number] = true;
      ++part_.lost;
      return;
    }
    for (const auto& of : taps) add(number, *of.block, of.taps, ready);
    ready.end(part_.part.ops[number]);
  }

  void need(uint32_t view, BlockPosition position) {
    const uint32_t cell = cache_.grid(view).cellOf(position);
    if (neededLately_.isNew(uint64_t{view} << 32 | cell))
      part_.needed.push_back({view, *cache_.views()[view].find(position)});
  }

  const BlockCache& cache_;
  AnsweredPart& part_;
  Lately lately_;       // places of blocks whose coefficients were asked of memory
  Lately neededLately_; // blocks that were noted
};

void answerReady(const LightRows& rows, const Ready& ready, LookUpKernel lookUp) {
  uint32_t job = 0;
  for (const auto& [rowBegin, rowEnd, jobsEnd] : std::span(ready.groups).first(ready.groupCount)) {
    lookUp(rows.lights.data() + rowBegin, rowEnd - rowBegin, rows.weights.data(), ready.jobs.data() + job,
           jobsEnd - job);
    job = jobsEnd;
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
    answerReady(*part.part.rows, *now, lookUp_);
    std::swap(now, next);
  }
  answerReady(*part.part.rows, *now, lookUp_);
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

} // namespace surflect::codec
