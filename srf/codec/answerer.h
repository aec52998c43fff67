// Answers operations of the shading queue: at once where their blocks are in memory, the others when many
// blocks have been fetched together.
#pragma once

#include "srf/codec/block_cache.h"
#include "srf/codec/look_up_kernel.h"
#include "srf/codec/shading_part.h"
#include "surfel/base/progress.h"
#include "surfel/math/rgb.h"
#include "surfel/math/simd.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::codec {

// A part, and what its operations add to their targets.
struct AnsweredPart {
  ShadingPart part;
  std::vector<std::array<float, 4>> radiance; // per operation: red, green, blue, and what means nothing
  std::vector<uint8_t> isLost;
  std::vector<uint32_t> waiting;     // operations some of whose blocks are not in memory
  std::vector<BlockKey> needed;      // all blocks of these, some of them several times
  std::vector<Rgb> sums;             // per target, once they are there
  uint64_t lookups = 0;              // operations x captured lights they blend
  uint64_t tasks = 0, taskRanks = 0; // of what is answered, as ShadingStats has them
  uint64_t lost = 0;                 // operations

  // Of one more part, in the same memory.
  void begin(const ShadingPart& next) {
    part = next;
    radiance.assign(part.ops.size(), {});
    isLost.assign(part.ops.size(), false);
    waiting.clear();
    needed.clear();
    sums.clear();
    lookups = tasks = taskRanks = lost = 0;
  }
};

class Answerer {
public:
  // All must outlive the answerer.
  Answerer(BlockCache& cache, Simd simd, const Progress& progress)
      : cache_(cache), lookUp_(lookUpKernel(simd)), progress_(progress) {}

  // What is in memory, in the order of the operations, of which neighbours share rows and blocks. Of many
  // parts at once by many threads.
  void answerResident(AnsweredPart& part) const;

  // What waits: blocks of several parts are fetched together, in the order of the disk. Afterwards the blocks
  // that each part needed are sorted, each once. Throws Error as ViewFile::read.
  void answerWaiting(std::span<AnsweredPart> parts) const;

private:
  void answerFetched(std::span<AnsweredPart> parts, std::span<const BlockKey> blocks) const;
  void answerAll(AnsweredPart& part, size_t count, const auto& numberOf) const;

  BlockCache& cache_;
  LookUpKernel lookUp_;
  const Progress& progress_;
};

} // namespace surflect::codec
