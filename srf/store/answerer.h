// Answers operations of the shading queue: what is in memory at once, what is not in the order of the disk.
#pragma once

#include "srf/store/block_cache.h"
#include "srf/store/look_up_kernel.h"
#include "srf/store/shading_queue.h"
#include "surfel/progress.h"
#include "surfel/rgb.h"

#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

// What the operations of a part add to their targets.
struct Answers {
  std::vector<Rgb> radiance; // per operation, weighted
  std::vector<uint8_t> isLost;
};

struct Answered {
  std::vector<Answers> parts;
  uint64_t tasks = 0, ranks = 0, hits = 0; // as ShadingStats has them
};

class Answerer {
public:
  // All must outlive the answerer.
  Answerer(BlockCache& cache, Simd simd, const Progress& progress)
      : cache_(cache), lookUp_(lookUpKernel(simd)), progress_(progress) {}

  // What is in memory is answered in the order of the operations, of which neighbours share rows and blocks;
  // what is not, in the order in which it lies on disk, each block fetched once.
  Answered answer(std::span<const ShadingPart> parts) const;

private:
  struct Ready;
  struct Run;
  struct Task;
  struct Waiting;

  void answerResident(Run& run) const;
  void prepare(Run& run, size_t i, Ready& ready) const;
  void answerReady(const Ready& ready) const;
  void announce(std::span<const Task> sorted, std::span<const size_t> first) const;
  uint64_t sweep(const Waiting& waiting) const;

  BlockCache& cache_;
  LookUpKernel lookUp_;
  const Progress& progress_;
};

} // namespace surflect
