#include "srf/store/answerer.h"

#include "srf/store/view_taps.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <compare>
#include <cstdint>
#include <memory>

namespace surflect {

namespace {

constexpr size_t kLineBytes = 64; // of the processor's caches
constexpr size_t kOpsAtOnce = 16; // that the processor fetches for while others are answered
constexpr size_t kMostJobs = 4 * kOpsAtOnce;

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

// Blocks that were asked for lately, and most likely are near the processor still.
class LatelyFetched {
public:
  bool knows(const void* block) {
    const auto hash = (reinterpret_cast<uintptr_t>(block) >> 6) * 0x9e3779b97f4a7c15;
    const void*& last = blocks_[hash >> 59];
    if (last == block) return true;
    last = block;
    return false;
  }

private:
  std::array<const void*, 32> blocks_{};
};

// Asks the processor for what a look-up will read. Not a call: for the compiler it would have no effect, and
// be left out.
[[gnu::always_inline]] inline void fetchAhead(const BlockTerms& block, const BlockTaps& taps,
                                              const Asked& asked, LatelyFetched& lately) {
  if (block.rank == 0) return;
  const auto fetch = [](const void* begin, size_t bytes) {
    for (size_t at = 0; at < bytes; at += kLineBytes)
      __builtin_prefetch(static_cast<const char*>(begin) + at);
    __builtin_prefetch(static_cast<const char*>(begin) + bytes - 1);
  };
  const size_t twoTexels = 6 * static_cast<size_t>(block.stride); // that of the left and that of the right
  fetch(block.texel(taps.texels[0]), twoTexels);
  fetch(block.texel(taps.texels[2]), twoTexels);
  if (lately.knows(block.coefficients)) return;
  for (size_t l = 0; l < asked.lights(); ++l) __builtin_prefetch(block.light(asked.row[l].light));
}

LookUpJob jobOf(const BlockTerms& block, const BlockTaps& taps) {
  return {block.levels, block.coefficients, static_cast<size_t>(block.stride), &taps};
}

void add(const Asked& asked, const float* rgb) {
  *asked.radiance = *asked.radiance + asked.op->weight * Rgb{rgb[0], rgb[1], rgb[2]};
}

} // namespace

// Of what waits, in all parts.
struct Answerer::Task {
  uint64_t key; // view, block
  uint32_t part, number;

  uint32_t view() const { return static_cast<uint32_t>(key >> 32); }
  uint32_t block() const { return static_cast<uint32_t>(key); }
  friend auto operator<=>(const Task&, const Task&) = default;
};

// Some operations whose blocks are all in memory.
struct Answerer::Ready {
  struct Operation {
    Asked asked;
    size_t firstJob;
  };
  std::array<Operation, kOpsAtOnce> operations;
  std::array<LookUpJob, kMostJobs> jobs;
  std::array<BlockTaps, kMostJobs> taps; // of each job
  size_t count = 0, jobCount = 0;
  LatelyFetched lately = {};

  void begin(const Asked& asked) { operations[count] = {asked, jobCount}; }
  [[gnu::always_inline]] void add(const BlockTerms& block, const BlockTaps& ofBlock) {
    fetchAhead(block, ofBlock, operations[count].asked, lately);
    taps[jobCount] = ofBlock;
    jobs[jobCount] = jobOf(block, taps[jobCount]);
    ++jobCount;
  }
  void drop() { jobCount = operations[count].firstJob; }
  size_t jobsEnd(size_t i) const { return i + 1 < count ? operations[i + 1].firstJob : jobCount; }
};

// A few at a time: finds their blocks and asks the processor for them; then answers, those of one row
// together.
void Answerer::answerResident(AnsweredPart& part) const {
  Ready ready;
  const size_t ops = part.part.ops.size();
  for (size_t begin = 0; begin < ops; begin += kOpsAtOnce) {
    ready.count = ready.jobCount = 0;
    for (size_t i = begin; i < std::min(ops, begin + kOpsAtOnce); ++i) prepare(part, i, ready);
    answerReady(ready);
  }
}

void Answerer::prepare(AnsweredPart& part, size_t i, Ready& ready) const {
  const Asked asked(part, i);
  const uint32_t view = asked.op->view;
  const ViewFile& file = cache_.views()[view];
  const TexelPlace place = TexelPlace::at(file.header(), asked.op->x, asked.op->y);
  ready.begin(asked);
  uint64_t ranks = 0;
  const auto wait = [&](const ViewTaps& all) {
    ready.drop();
    for (const auto& [number, taps] : all)
      part.waiting.push_back({view, number, static_cast<uint32_t>(i), taps});
  };
  const auto isHere = [&](uint32_t number, const BlockTaps& taps) {
    const auto block = cache_.resident(view, number);
    if (!block) return false;
    ready.add(*block, taps);
    ranks += static_cast<uint64_t>(block->rank);
    return true;
  };
  if (place.isInOneBlock()) { // most are; tapsAt would say the same
    const auto number = file.find(place.block());
    part.isLost[i] = !number;
    if (number && !isHere(*number, place.taps())) return wait(tapsAt(file, place));
  } else {
    const ViewTaps all = tapsAt(file, place);
    part.isLost[i] = all.empty();
    for (const auto& [number, taps] : all)
      if (!isHere(number, taps)) return wait(all);
  }
  part.hits += ready.jobCount - ready.operations[ready.count].firstJob;
  part.ranks += ranks;
  ++ready.count;
}

void Answerer::answerReady(const Ready& ready) const {
  std::array<float, 3 * kMostJobs> rgb;
  for (size_t first = 0; first < ready.count;) {
    const auto& [asked, firstJob] = ready.operations[first];
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

// Tasks by block, and where those of each block begin.
void Answerer::announce(std::span<const Task> sorted, std::span<const size_t> first) const {
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

uint64_t Answerer::sweep(std::span<AnsweredPart> parts) const {
  std::vector<Task> sorted;
  for (uint32_t p = 0; p < parts.size(); ++p)
    for (uint32_t i = 0; i < parts[p].waiting.size(); ++i) {
      const WaitingTask& task = parts[p].waiting[i];
      sorted.push_back({uint64_t{task.view} << 32 | task.block, p, i});
    }
  tbb::parallel_sort(sorted); // no two compare equal: one order only
  std::vector<size_t> first;  // task in each block; one more, for the end
  for (size_t t = 0; t < sorted.size(); ++t)
    if (t == 0 || sorted[t].key != sorted[t - 1].key) first.push_back(t);
  const size_t blocks = first.size();
  first.push_back(sorted.size());

  announce(sorted, first);
  using Result = std::array<float, 3>;
  std::vector<std::vector<Result>> results; // of each part's tasks
  for (const AnsweredPart& part : parts) results.emplace_back(part.waiting.size());
  std::vector<uint64_t> ranksOf(blocks);
  tbb::parallel_for(size_t{0}, blocks, [&](size_t b) {
    progress_.checkpoint();
    const std::span ofBlock = std::span<const Task>(sorted).subspan(first[b], first[b + 1] - first[b]);
    const std::shared_ptr<const Block> block = cache_.get(ofBlock[0].view(), ofBlock[0].block());
    ranksOf[b] = static_cast<uint64_t>(block->rank) * ofBlock.size();
    for (const Task& task : ofBlock) {
      AnsweredPart& part = parts[task.part];
      const WaitingTask& waiting = part.waiting[task.number];
      const Asked asked(part, waiting.op);
      const LookUpJob job = jobOf(block->terms(), waiting.taps);
      lookUp_(asked.row, asked.lights(), &job, 1, results[task.part][task.number].data());
    }
  });
  for (size_t p = 0; p < parts.size(); ++p)
    for (size_t i = 0; i < results[p].size(); ++i)
      add(Asked(parts[p], parts[p].waiting[i].op), results[p][i].data());
  uint64_t ranks = 0;
  for (const uint64_t ofBlock : ranksOf) ranks += ofBlock;
  return ranks;
}

} // namespace surflect
