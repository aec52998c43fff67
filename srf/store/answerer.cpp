#include "srf/store/answerer.h"

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

constexpr size_t kLineBytes = 64; // of the processor's caches
constexpr size_t kOpsAtOnce = 16; // that the processor fetches for while others are answered
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

// Which numbers, above 0, were asked for lately.
class Lately {
public:
  bool knows(uint64_t number) {
    uint64_t& last = numbers_[number * 0x9e3779b97f4a7c15 >> 59];
    return std::exchange(last, number) == number;
  }

private:
  std::array<uint64_t, 32> numbers_{};
};

// Asks the processor for what a look-up will read. Not a call: for the compiler it would have no effect, and
// be left out.
[[gnu::always_inline]] inline void fetchAhead(const BlockTerms& block, const BlockTaps& taps,
                                              const Asked& asked, Lately& fetched) {
  if (block.rank == 0) return;
  const auto fetch = [](const void* begin, size_t bytes) {
    for (size_t at = 0; at < bytes; at += kLineBytes)
      __builtin_prefetch(static_cast<const char*>(begin) + at);
    __builtin_prefetch(static_cast<const char*>(begin) + bytes - 1);
  };
  const size_t twoTexels = 6 * static_cast<size_t>(block.stride); // that of the left and that of the right
  fetch(block.texel(taps.texels[0]), twoTexels);
  fetch(block.texel(taps.texels[2]), twoTexels);
  // What was asked for lately most likely is near the processor still.
  if (fetched.knows(reinterpret_cast<uintptr_t>(block.coefficients) / kLineBytes)) return;
  for (size_t l = 0; l < asked.lights(); ++l) __builtin_prefetch(block.light(asked.row[l].light));
}

LookUpJob jobOf(const BlockTerms& block, const BlockTaps& taps) {
  return {block.levels, block.coefficients, static_cast<size_t>(block.stride), &taps};
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
  };
  std::array<Operation, kOpsAtOnce> operations;
  std::array<LookUpJob, kMostJobs> jobs;
  std::array<BlockTaps, kMostJobs> taps; // of each job
  size_t count = 0, jobCount = 0;
  Lately fetched = {}; // coefficients
  Lately needed = {};  // blocks that are not in memory

  void begin(const Asked& asked) { operations[count] = {asked, jobCount}; }
  [[gnu::always_inline]] void add(const BlockTerms& block, const BlockTaps& ofBlock) {
    fetchAhead(block, ofBlock, operations[count].asked, fetched);
    taps[jobCount] = ofBlock;
    jobs[jobCount] = jobOf(block, taps[jobCount]);
    ++jobCount;
  }
  void drop() { jobCount = operations[count].firstJob; }
  size_t jobsEnd(size_t i) const { return i + 1 < count ? operations[i + 1].firstJob : jobCount; }
};

// A few at a time: finds their blocks and asks the processor for them; then answers, those of one row
// together.
void Answerer::answerAll(AnsweredPart& part, size_t count, const auto& numberOf) const {
  Ready ready;
  for (size_t begin = 0; begin < count; begin += kOpsAtOnce) {
    ready.count = ready.jobCount = 0;
    for (size_t i = begin; i < std::min(count, begin + kOpsAtOnce); ++i) prepare(part, numberOf(i), ready);
    answerReady(ready);
  }
}

void Answerer::answerResident(AnsweredPart& part) const {
  answerAll(part, part.part.ops.size(), [](size_t i) { return static_cast<uint32_t>(i); });
}

void Answerer::prepare(AnsweredPart& part, uint32_t i, Ready& ready) const {
  const Asked asked(part, i);
  const uint32_t view = asked.op->view;
  const ViewFile& file = cache_.views()[view];
  const TexelPlace place = TexelPlace::at(file.header(), asked.op->x, asked.op->y);
  ready.begin(asked);
  uint64_t ranks = 0;
  const auto wait = [&](const ViewTaps& all) {
    ready.drop();
    part.waiting.push_back(i);
    for (const auto& [number, taps] : all)
      if (!ready.needed.knows(uint64_t{view} << 32 | (number + 1))) part.needed.push_back({view, number});
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
  part.tasks += ready.jobCount - ready.operations[ready.count].firstJob;
  part.taskRanks += ranks;
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
