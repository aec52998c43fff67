#include "srf/shading/executor.h"

#include "srf/shading/taps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

namespace surflect::shading {

namespace {

constexpr size_t kOpsAtOnce = 32;      // operations prefetched while the previous batch is executed
constexpr size_t kBlocksAtOnce = 4096; // blocks fetched together; more only if one part needs more

// Direct-mapped filter of recently seen keys: later keys overwrite earlier ones in a hash table.
class RecentKeys {
public:
  // Inserts a key; returns true unless it was seen recently.
  bool insert(uint64_t key) {
    uint64_t& held = held_[key * kGolden >> (64 - kBits)];
    return std::exchange(held, key + 1) != key + 1;
  }

private:
  static constexpr int kBits = 9;                         // a part has about 150 blocks
  static constexpr uint64_t kGolden = 0x9e3779b97f4a7c15; // 2^64 over the golden ratio
  std::array<uint64_t, size_t{1} << kBits> held_{};       // keys + 1
};

// Texel position of an operation, and the places (BlockCache::Grid) of its blocks in the order of
// forEachBlock.
struct Location {
  TexelPosition place;
  bool areInMemory; // true if all blocks are in memory
  bool isWaiting;   // true if a block is on disk
  std::array<uint32_t, 4> blocks;
};

// Look-ups in resident blocks, grouped by the light rows of their operations.
struct JobBatch {
  struct Group {
    uint32_t rowBegin, rowEnd;
    uint32_t jobsEnd;
  };
  std::array<Group, kOpsAtOnce> groups;
  std::array<BlockLookup, 4 * kOpsAtOnce> jobs;
  uint32_t groupCount = 0, jobCount = 0;

  void clear() { groupCount = jobCount = 0; }
  // Adds a look-up and prefetches its texels. Inlined, since compilers drop a call whose only effect is
  // prefetching.
  [[gnu::always_inline]] void add(const codec::BlockTerms& block, const BlockTaps& taps, float* rgb) {
    const BlockLookup& job = jobs[jobCount++] = jobOf(block, taps, rgb);
    const size_t last = 6 * static_cast<size_t>(block.stride) - 1; // last byte of two neighbouring texels
    for (const int8_t* upper : {job.levels, job.levels + job.down}) {
      __builtin_prefetch(upper);
      __builtin_prefetch(upper + last);
    }
  }
  // Assigns the jobs added since the last call to the operation's group.
  void end(const ShadingOp& op) {
    const bool sharesRow = groupCount > 0 && groups[groupCount - 1].rowBegin == op.rowBegin &&
                           groups[groupCount - 1].rowEnd == op.rowEnd;
    if (!sharesRow) ++groupCount;
    groups[groupCount - 1] = {op.rowBegin, op.rowEnd, jobCount};
  }
};

// Turns operations into look-up jobs, or notes the blocks that they wait for.
class JobMaker {
public:
  JobMaker(const codec::BlockCache& cache, ExecutedPart& part) : cache_(cache), part_(part) {}

  // Finds the blocks of an operation and prefetches their entries in the cache.
  [[gnu::always_inline]] void locate(const ShadingOp& op, Location& location) const {
    const codec::BlockCache::Grid& grid = cache_.grid(op.view);
    location.place = TexelPosition::at(grid.header, op.x, op.y);
    location.areInMemory = true;
    location.isWaiting = false;
    uint32_t* next = location.blocks.data();
    forEachBlock(location.place, [&](codec::BlockPosition position) {
      const uint32_t block = *next++ = grid.placeOf(position);
      const bool isInMemory = codec::BlockCache::isInMemory(block);
      location.areInMemory &= isInMemory;
      location.isWaiting |= block == codec::BlockCache::kOnDisk;
      if (isInMemory) cache_.prefetchEntry(block);
    });
  }

  [[gnu::always_inline]] void makeJobs(uint32_t number, const Location& location, JobBatch& jobs) {
    if (location.isWaiting) return wait(number, location);
    if (!location.areInMemory) return makeJobsBesideBackground(number, location, jobs);
    const uint32_t* next = location.blocks.data();
    if (location.place.isInOneBlock())
      add(number, *next, location.place.tapsInOneBlock(), jobs);
    else
      forEachBlock(location.place, [&](codec::BlockPosition position) {
        add(number, *next++, location.place.tapsIn(position), jobs);
      });
    jobs.end(part_.part.ops[number]);
  }

private:
  [[gnu::always_inline]] void add(uint32_t number, uint32_t block, const BlockTaps& taps, JobBatch& jobs) {
    const ShadingOp& op = part_.part.ops[number];
    const codec::BlockTerms terms = cache_.resident(block).terms(cache_.grid(op.view).header);
    ++part_.tasks;
    part_.taskRanks += static_cast<uint64_t>(terms.rank);
    if (terms.rank == 0) return;
    jobs.add(terms, taps, part_.radiance[number].data());
    if (prefetched_.insert(block)) fetchLights(terms, op);
  }

  // Prefetches the coefficients of the row's lights; neighbouring operations use nearly the same lights.
  [[gnu::always_inline]] void fetchLights(const codec::BlockTerms& terms, const ShadingOp& op) const {
    for (const weights::LightWeight& of : part_.part.rows->weightsOf(op.rowBegin, op.rowEnd))
      __builtin_prefetch(terms.light(of.light));
  }

  // Notes all blocks of the operation, including resident ones, so that none is evicted before it is
  // executed.
  void wait(uint32_t number, const Location& location) {
    const uint32_t view = part_.part.ops[number].view;
    part_.waiting.push_back(number);
    const uint32_t* next = location.blocks.data();
    forEachBlock(location.place, [&](codec::BlockPosition position) {
      if (*next++ != codec::BlockCache::kBackground) need(view, position);
    });
  }

  // Adds the jobs of an operation that partly falls on background.
  void makeJobsBesideBackground(uint32_t number, const Location& location, JobBatch& jobs) {
    const uint32_t* next = location.blocks.data();
    const auto find = [&](codec::BlockPosition) {
      const uint32_t place = *next++;
      return place == codec::BlockCache::kBackground ? std::nullopt : std::optional(place);
    };
    ViewTaps<std::optional<uint32_t>> taps;
    findTaps(location.place, find, taps);
    if (taps.empty()) {
      part_.isLost[number] = true;
      ++part_.lost;
      return;
    }
    for (const auto& of : taps) add(number, *of.block, of.taps, jobs);
    jobs.end(part_.part.ops[number]);
  }

  void need(uint32_t view, codec::BlockPosition position) {
    const uint32_t cell = cache_.grid(view).cellOf(position);
    if (noted_.insert(uint64_t{view} << 32 | cell))
      part_.needed.push_back({view, *cache_.views()[view].find(position)});
  }

  const codec::BlockCache& cache_;
  ExecutedPart& part_;
  RecentKeys prefetched_; // places of blocks with prefetched coefficients
  RecentKeys noted_;      // blocks already in `needed`
};

void run(const JobBatch& batch, const weights::LightRows& rows) {
  uint32_t job = 0;
  for (const auto& [rowBegin, rowEnd, jobsEnd] : std::span(batch.groups).first(batch.groupCount)) {
    lookUp(rows.lights.data() + rowBegin, rowEnd - rowBegin, rows.weights.data(), batch.jobs.data() + job,
           jobsEnd - job);
    job = jobsEnd;
  }
}

} // namespace

// Executes operations in batches: while one is executed, the texels of the next are prefetched.
void Executor::executeAll(ExecutedPart& part, size_t count, const auto& numberOf) const {
  JobMaker maker(cache_, part);
  std::array<Location, kOpsAtOnce> locations;
  std::array<JobBatch, 2> batches;
  JobBatch *now = &batches[0], *next = &batches[1];
  for (size_t begin = 0; begin < count; begin += kOpsAtOnce) {
    const size_t some = std::min(kOpsAtOnce, count - begin);
    for (size_t i = 0; i < some; ++i) maker.locate(part.part.ops[numberOf(begin + i)], locations[i]);
    next->clear();
    for (size_t i = 0; i < some; ++i) maker.makeJobs(numberOf(begin + i), locations[i], *next);
    run(*now, *part.part.rows);
    std::swap(now, next);
  }
  run(*now, *part.part.rows);
}

void Executor::executeResident(ExecutedPart& part) const {
  for (const ShadingOp& op : part.part.ops)
    part.lookups += part.part.rows->weightsOf(op.rowBegin, op.rowEnd).size();
  const std::span asked = part.part.asked;
  if (part.part.kept)
    executeAll(part, asked.size(), [&](size_t i) { return asked[i].op; });
  else
    executeAll(part, part.part.ops.size(), [](size_t i) { return static_cast<uint32_t>(i); });
}

void Executor::executeWaiting(std::span<ExecutedPart> parts) const {
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    std::vector<codec::BlockKey>& needed = parts[p].needed;
    std::ranges::sort(needed);
    needed.erase(std::ranges::unique(needed).begin(), needed.end());
  });
  std::vector<codec::BlockKey> blocks, more;
  for (size_t begin = 0, end = 0; begin < parts.size(); begin = end) {
    blocks = parts[end++].needed;
    for (; end < parts.size(); ++end) {
      more.clear();
      std::ranges::set_union(blocks, parts[end].needed, std::back_inserter(more));
      if (more.size() > kBlocksAtOnce) break;
      blocks.swap(more);
    }
    if (!blocks.empty()) executeFetched(parts.subspan(begin, end - begin), blocks);
  }
}

void Executor::executeFetched(std::span<ExecutedPart> parts, std::span<const codec::BlockKey> blocks) const {
  struct Trim {
    codec::BlockCache& cache;
    ~Trim() { cache.trim(); }
  } const trim{cache_};
  cache_.fetch(blocks, progress_);
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t p) {
    progress_.checkpoint();
    const std::vector<uint32_t> waiting = std::exchange(parts[p].waiting, {});
    executeAll(parts[p], waiting.size(), [&](size_t i) { return waiting[i]; });
    assert(parts[p].waiting.empty());
  });
}

} // namespace surflect::shading
