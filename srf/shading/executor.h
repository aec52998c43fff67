// Executes operations of the shading queue: at once where their blocks are in memory, the others when many
// blocks have been fetched together.
#pragma once

#include "srf/codec/block_cache.h"
#include "srf/shading/look_up_kernel.h"
#include "srf/shading/operations.h"
#include "surfel/base/progress.h"
#include "surfel/math/rgb.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::shading {

// A part and the results of its operations.
struct ExecutedPart {
  ShadingPart part;
  std::vector<std::array<float, 4>> radiance; // per operation: red, green, blue, and a number without meaning
  std::vector<uint8_t> isLost;                // per operation: its view shows background there
  std::vector<uint32_t> waiting;              // operations some of whose blocks are not in memory
  std::vector<codec::BlockKey> needed;        // all blocks of these, some of them several times
  std::vector<Rgb> sums;                      // per target; empty until all operations are executed
  uint64_t lookups = 0;                       // operations x captured lights they blend
  uint64_t tasks = 0, taskRanks = 0;          // of executed operations, as ShadingStats has them
  uint64_t lost = 0;                          // operations

  // Starts on another part, in the same memory.
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

class Executor {
public:
  // All must outlive the executor.
  Executor(codec::BlockCache& cache, const Progress& progress) : cache_(cache), progress_(progress) {}

  // Executes the operations whose blocks are in memory, in their order: neighbours share rows and blocks.
  // Notes the others in `waiting`. Safe from many threads at once, each with a part of its own.
  void executeResident(ExecutedPart& part) const;

  // Executes all waiting operations. The blocks of several parts are fetched together, in the order of the
  // disk. Leaves each part's `needed` sorted and without repeats. Throws Error as ViewFile::read.
  void executeWaiting(std::span<ExecutedPart> parts) const;

private:
  void executeFetched(std::span<ExecutedPart> parts, std::span<const codec::BlockKey> blocks) const;
  void executeAll(ExecutedPart& part, size_t count, const auto& numberOf) const;

  codec::BlockCache& cache_;
  const Progress& progress_;
};

} // namespace surflect::shading
