// Answers operations of the shading queue: what is in memory at once, what is not in the order of the disk.
#pragma once

#include "srf/store/block_cache.h"
#include "srf/store/look_up_kernel.h"
#include "srf/store/shading_part.h"
#include "surfel/progress.h"
#include "surfel/rgb.h"
#include "surfel/simd.h"

#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

// A look-up in a block that is not in memory.
struct WaitingTask {
  uint32_t view, block;
  uint32_t op; // of the part
  BlockTaps taps;
};

// A part, and what its operations add to their targets.
struct AnsweredPart {
  ShadingPart part;
  std::vector<Rgb> radiance; // per operation, weighted
  std::vector<uint8_t> isLost;
  std::vector<WaitingTask> waiting; // those of an operation lie together, in the order of their sum
  uint64_t hits = 0, ranks = 0;     // of tasks answered at once, as ShadingStats has them

  // Of one more part, in the same memory.
  void begin(const ShadingPart& next) {
    part = next;
    radiance.assign(part.ops.size(), {});
    isLost.assign(part.ops.size(), false);
    waiting.clear();
    hits = ranks = 0;
  }
};

class Answerer {
public:
  // All must outlive the answerer.
  Answerer(BlockCache& cache, Simd simd, const Progress& progress)
      : cache_(cache), lookUp_(lookUpKernel(simd)), progress_(progress) {}

  // What is in memory, in the order of the operations, of which neighbours share rows and blocks.
  void answerResident(AnsweredPart& part) const;

  // What waits, in the order in which it lies on disk, each block fetched once. Returns the sum of the
  // blocks' ranks over tasks. Throws Error as ViewFile::read.
  uint64_t sweep(std::span<AnsweredPart> parts) const;

private:
  struct Ready;
  struct Task;

  void prepare(AnsweredPart& part, size_t i, Ready& ready) const;
  void answerReady(const Ready& ready) const;
  void announce(std::span<const Task> sorted, std::span<const size_t> first) const;

  BlockCache& cache_;
  LookUpKernel lookUp_;
  const Progress& progress_;
};

} // namespace surflect
