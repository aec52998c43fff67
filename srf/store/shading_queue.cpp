// Symbols: e_k eigenimage, a_kl coefficient of light l, w_l light weight, K rank.
#include "srf/store/shading_queue.h"

#include "srf/store/view_taps.h"
#include "surfel/error.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>

namespace surflect {

namespace {

constexpr size_t kOpsPerRun = 1024;
constexpr size_t kLineBytes = 64; // of the processor's caches
constexpr size_t kOpsAtOnce = 16; // that the processor fetches for while others are answered

// Of an operation, in one block; its result goes to slots[slot].
struct Task {
  uint64_t key = 0; // view, block
  uint32_t op = 0, slot = 0;

  uint32_t view() const { return static_cast<uint32_t>(key >> 32); }
  uint32_t block() const { return static_cast<uint32_t>(key); }
  friend bool operator<(const Task& a, const Task& b) {
    return a.key != b.key ? a.key < b.key : a.slot < b.slot;
  }
};

// Operations that wait for blocks. The tasks of one lie together, in the order of their sum.
struct Waiting {
  std::vector<Task> tasks;
  std::vector<BlockTaps> taps; // of each task

  void add(const ShadingOp& op, uint32_t number, const ViewTaps& all) {
    for (const auto& [block, ofBlock] : all) {
      tasks.push_back({uint64_t{op.view} << 32 | block, number, static_cast<uint32_t>(tasks.size())});
      taps.push_back(ofBlock);
    }
  }
};

// What operations add to their targets.
struct Answered {
  std::vector<Rgb> radiance;               // per operation, weighted
  std::vector<uint8_t> isLost;             // per operation
  uint64_t tasks = 0, ranks = 0, hits = 0; // as ShadingStats has them
};

class Answerer {
public:
  Answerer(std::span<const LightWeight> rows, BlockCache& cache, Simd simd, const Progress& progress)
      : rows_(rows), cache_(cache), lookUp_(lookUpKernel(simd)), progress_(progress) {}

  // What is in memory is answered in the order of the operations, of which neighbours share rows and blocks;
  // what is not, in the order in which it lies on disk, each block fetched once.
  Answered answer(std::span<const ShadingOp> ops) const {
    Answered answered{std::vector<Rgb>(ops.size()), std::vector<uint8_t>(ops.size())};
    std::vector<Run> runs((ops.size() + kOpsPerRun - 1) / kOpsPerRun);
    tbb::parallel_for(size_t{0}, runs.size(), [&](size_t r) {
      progress_.checkpoint();
      const size_t end = std::min(ops.size(), (r + 1) * kOpsPerRun);
      for (size_t i = r * kOpsPerRun; i < end; i += kOpsAtOnce)
        answerResident(ops, i, std::min(end, i + kOpsAtOnce), runs[r], answered);
    });
    for (const Run& run : runs) {
      answered.tasks += run.hits + run.waiting.tasks.size();
      answered.ranks += run.ranks;
      answered.hits += run.hits;
    }
    if (answered.hits < answered.tasks) sweep(ops, joined(std::move(runs)), answered);
    return answered;
  }

private:
  struct Run {
    Waiting waiting;
    uint64_t hits = 0, ranks = 0;
  };

  Rgb answerIn(const BlockTerms& block, const ShadingOp& op, const BlockTaps& taps) const {
    float rgb[3];
    lookUp_({block.levels, block.coefficients, static_cast<size_t>(block.stride), rows_.data() + op.rowBegin,
             op.rowEnd - op.rowBegin},
            taps, rgb);
    return op.weight * Rgb{rgb[0], rgb[1], rgb[2]};
  }

  // Of an operation whose blocks are all in memory.
  struct Ready {
    uint32_t number;
    ViewTaps taps;
    std::array<BlockTerms, 4> blocks;
  };

  // Where an operation's blocks are, and asks the processor for what will be read of them.
  bool isReady(const ShadingOp& op, Ready& ready) const {
    for (size_t i = 0; i < ready.taps.size(); ++i) {
      const auto block = cache_.resident(op.view, ready.taps[i].block);
      if (!block) return false;
      ready.blocks[i] = *block;
    }
    for (size_t i = 0; i < ready.taps.size(); ++i) fetchAhead(ready.blocks[i], op, ready.taps[i].taps);
    return true;
  }

  // Not a call: for the compiler it would have no effect, and be left out.
  [[gnu::always_inline]] void fetchAhead(const BlockTerms& block, const ShadingOp& op,
                                         const BlockTaps& taps) const {
    if (block.rank == 0) return;
    const size_t texelBytes = 3 * static_cast<size_t>(block.stride);
    for (uint32_t t = 0; t < taps.count; ++t) {
      const auto* texel = reinterpret_cast<const char*>(block.texel(taps.texels[t]));
      for (size_t at = 0; at < texelBytes; at += kLineBytes) __builtin_prefetch(texel + at);
      __builtin_prefetch(texel + texelBytes - 1);
    }
    for (uint32_t l = op.rowBegin; l < op.rowEnd; ++l) __builtin_prefetch(block.light(rows_[l].light));
  }

  void answerResident(std::span<const ShadingOp> ops, size_t begin, size_t end, Run& run,
                      Answered& answered) const {
    std::array<Ready, kOpsAtOnce> ready;
    size_t count = 0;
    for (size_t i = begin; i < end; ++i) {
      const auto number = static_cast<uint32_t>(i);
      Ready& next = ready[count];
      next.number = number;
      next.taps = tapsAt(cache_.views()[ops[i].view], ops[i].x, ops[i].y);
      answered.isLost[i] = next.taps.empty();
      if (isReady(ops[i], next))
        ++count;
      else
        run.waiting.add(ops[i], number, next.taps);
    }
    for (const auto& [number, taps, blocks] : std::span(ready).first(count)) {
      Rgb& sum = answered.radiance[number];
      for (size_t i = 0; i < taps.size(); ++i) {
        sum = sum + answerIn(blocks[i], ops[number], taps[i].taps);
        run.ranks += static_cast<uint64_t>(blocks[i].rank);
      }
      run.hits += taps.size();
    }
  }

  static Waiting joined(std::vector<Run> runs) {
    size_t tasks = 0;
    for (const Run& run : runs) tasks += run.waiting.tasks.size();
    if (tasks > std::numeric_limits<uint32_t>::max()) throw Error("too many look-ups to be queued at once");
    Waiting all;
    all.tasks.reserve(tasks);
    all.taps.reserve(tasks);
    for (Run& run : runs) {
      const Waiting waiting = std::move(run.waiting); // and gone after it
      const auto first = static_cast<uint32_t>(all.tasks.size());
      for (const Task& task : waiting.tasks) all.tasks.push_back({task.key, task.op, first + task.slot});
      all.taps.insert(all.taps.end(), waiting.taps.begin(), waiting.taps.end());
    }
    return all;
  }

  // Of tasks by block, and where those of each block begin.
  void announce(std::span<const Task> sorted, std::span<const size_t> first) const {
    std::vector<uint32_t> blocks; // of one view
    for (size_t b = 0; b + 1 < first.size(); ++b) {
      const Task& task = sorted[first[b]];
      if (!cache_.resident(task.view(), task.block())) blocks.push_back(task.block());
      const size_t next = first[b + 1];
      if (next < sorted.size() && sorted[next].view() == task.view()) continue;
      cache_.views()[task.view()].announce(blocks);
      blocks.clear();
    }
  }

  void sweep(std::span<const ShadingOp> ops, const Waiting& waiting, Answered& answered) const {
    std::vector<Task> sorted = waiting.tasks;
    tbb::parallel_sort(sorted); // no two compare equal: one order only
    std::vector<size_t> first;  // task in each block; one more, for the end
    for (size_t t = 0; t < sorted.size(); ++t)
      if (t == 0 || sorted[t].key != sorted[t - 1].key) first.push_back(t);
    const size_t blocks = first.size();
    first.push_back(sorted.size());

    announce(sorted, first);
    std::vector<Rgb> slots(sorted.size());
    std::vector<uint64_t> ranksOf(blocks);
    tbb::parallel_for(size_t{0}, blocks, [&](size_t b) {
      progress_.checkpoint();
      const std::span ofBlock = std::span<const Task>(sorted).subspan(first[b], first[b + 1] - first[b]);
      const std::shared_ptr<const Block> block = cache_.get(ofBlock[0].view(), ofBlock[0].block());
      ranksOf[b] = static_cast<uint64_t>(block->rank) * ofBlock.size();
      for (const Task& task : ofBlock)
        slots[task.slot] = answerIn(block->terms(), ops[task.op], waiting.taps[task.slot]);
    });
    for (const Task& task : waiting.tasks) {
      Rgb& sum = answered.radiance[task.op];
      sum = sum + slots[task.slot];
    }
    for (const uint64_t ofBlock : ranksOf) answered.ranks += ofBlock;
  }

  std::span<const LightWeight> rows_;
  BlockCache& cache_;
  LookUpKernel lookUp_;
  const Progress& progress_;
};

// Operations of targets that see nothing but background: their numbers, ascending.
std::vector<uint32_t> blindOps(std::span<const ShadingOp> ops, std::span<const uint8_t> isLost,
                               size_t targets) {
  std::vector<uint8_t> sees(targets);
  for (size_t i = 0; i < ops.size(); ++i) sees[ops[i].target] |= !isLost[i];
  std::vector<uint32_t> blind;
  for (uint32_t i = 0; i < ops.size(); ++i)
    if (!sees[ops[i].target]) blind.push_back(i);
  return blind;
}

// Moves them to what their views store nearest.
std::vector<ShadingOp> sighted(std::span<const ShadingOp> ops, std::span<const uint32_t> blind,
                               std::span<const ViewFile> views, const Progress& progress) {
  std::vector<ShadingOp> moved;
  for (const uint32_t number : blind) moved.push_back(ops[number]);
  tbb::parallel_for(size_t{0}, moved.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    ShadingOp& op = moved[i];
    if (const auto stored = nearestStored(views[op.view], op.x, op.y)) op.x = stored->x, op.y = stored->y;
  });
  return moved;
}

// What remains of a target when some of its operations are lost.
struct Coverage {
  double all = 0, kept = 0; // sums of weights

  float scale() const { return all == kept || kept == 0 ? 1.f : static_cast<float>(all / kept); }
};

} // namespace

std::vector<Rgb> execute(std::span<const ShadingOp> ops, std::span<const LightWeight> rows, size_t targets,
                         BlockCache& cache, ShadingStats& stats, const Progress& progress, Simd simd) {
  const std::span<const ViewFile> views = cache.views();
  assert(std::ranges::all_of(ops, [&](const ShadingOp& op) {
    return op.view < views.size() && op.target < targets && op.rowBegin <= op.rowEnd &&
           op.rowEnd <= rows.size();
  }));
  if (ops.size() > std::numeric_limits<uint32_t>::max())
    throw Error("too many look-ups to be queued at once");
  const CacheCounts before = cache.counts();
  const Answerer answerer(rows, cache, simd, progress);
  Answered answered = answerer.answer(ops);
  stats.lost += static_cast<uint64_t>(std::ranges::count(answered.isLost, true));
  if (const auto blind = blindOps(ops, answered.isLost, targets); !blind.empty()) {
    const Answered nearest = answerer.answer(sighted(ops, blind, views, progress));
    for (size_t i = 0; i < blind.size(); ++i) {
      answered.radiance[blind[i]] = nearest.radiance[i];
      answered.isLost[blind[i]] = nearest.isLost[i];
    }
    answered.tasks += nearest.tasks;
    answered.ranks += nearest.ranks;
    answered.hits += nearest.hits;
  }

  std::vector<Rgb> radiance(targets);
  std::vector<Coverage> coverage(targets);
  for (size_t i = 0; i < ops.size(); ++i) {
    const ShadingOp& op = ops[i];
    stats.lookups += op.rowEnd - op.rowBegin;
    coverage[op.target].all += op.weight;
    if (answered.isLost[i]) continue;
    coverage[op.target].kept += op.weight;
    radiance[op.target] = radiance[op.target] + answered.radiance[i];
  }
  for (size_t target = 0; target < targets; ++target)
    radiance[target] = coverage[target].scale() * radiance[target];

  const CacheCounts after = cache.counts();
  stats.operations += ops.size();
  stats.tasks += answered.tasks;
  stats.taskRanks += answered.ranks;
  stats.blocksRead += after.reads - before.reads;
  stats.bytesRead += after.bytesRead - before.bytesRead;
  stats.cacheHits += answered.hits;
  return radiance;
}

} // namespace surflect
