// Executes operations of the shading queue: those with resident blocks at once, the others after many blocks
// have been fetched together.
#pragma once

#include "srf/codec/block_cache.h"
#include "srf/shading/block_lookup.h"
#include "srf/shading/plan.h"
#include "surfel/base/time.h"
#include "surfel/math/rgb.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::shading {

// A part of the queue and the results of its operations.
struct ExecutedPart {
  ShadingPart part;
  std::vector<std::array<float, 4>> radiance; // per operation: red, green, blue, unused
  std::vector<uint8_t> isLost;                // per operation: true if its view shows only background there
  std::vector<uint32_t> waiting;              // operations with a block that is not in memory
  std::vector<codec::BlockKey> needed;        // all blocks of waiting operations, with repeats
  std::vector<Rgb> sums;                      // per target; empty until all operations are executed
  uint64_t lookups = 0;                       // operations times the captured lights they blend
  uint64_t tasks = 0, taskRanks = 0;          // over executed operations; see ShadingStats
  uint64_t lost = 0;                          // number of lost operations

  // Starts on another part, reusing the memory.
  void begin(const ShadingPart& next) {
    part = next;
    radiance.assign(part.ops.size(), {});
    for (const auto& [op, slot] : part.known) {
      const Rgb& known = part.kept->radiance(slot);
      radiance[op] = {known.r, known.g, known.b, 0};
    }
    isLost.assign(part.ops.size(), false);
    waiting.clear();
    needed.clear();
    sums.clear();
    lookups = tasks = taskRanks = lost = 0;
  }
};

class Executor {
public:
  // The arguments must outlive the executor.
  Executor(codec::BlockCache& cache, const Progress& progress) : cache_(cache), progress_(progress) {}

  // Executes the operations whose radiance is not known and whose blocks are in memory, in order, as
  // neighbours share rows and blocks; lists the others in `waiting`. Safe from many threads at once with
  // different parts.
  void executeResident(ExecutedPart& part) const;

  // Executes all waiting operations. Blocks of several parts are fetched together, in disk order. Leaves each
  // part's `needed` sorted, without repeats. Throws Error as ViewFile::read does.
  void executeWaiting(std::span<ExecutedPart> parts) const;

private:
  void executeFetched(std::span<ExecutedPart> parts, std::span<const codec::BlockKey> blocks) const;
  void executeAll(ExecutedPart& part, size_t count, const auto& numberOf) const;

  codec::BlockCache& cache_;
  const Progress& progress_;
};

} // namespace surflect::shading
