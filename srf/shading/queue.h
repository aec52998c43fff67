// Deferred shading: a queue of many look-ups into reflectance images. Blocks that are not in memory are read
// in the order in which they lie on disk [Weyrich 2005, §5.3]. Look-ups are executed in their own order, in
// which neighbours share lights and blocks, first those whose blocks are in memory.
//
//   radiance[target] = sum over its operations of
//     weight * sum over bilinear taps of tap * sum_k (sum_l w_l a_kl) e_k(texel),   per channel, where
//
//   w_l = sum over the lights of its row of color * weight of the captured light l.
//
// Background: taps that fall into blocks left out are dropped, and the others renormalised. An operation
// without taps is lost; the target's other operations are scaled by (sum of all weights) / (sum of weights
// not lost). Where all of a target's are lost, each looks up what its view stores nearest: a surface whose
// silhouette and mesh disagree is continued, not black. A target is 0 only if its views store nothing.
#pragma once

#include "srf/codec/block_cache.h"
#include "srf/shading/executor.h"
#include "srf/shading/operations.h"
#include "surfel/base/progress.h"
#include "surfel/math/rgb.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::shading {

// Counts, summed over calls.
struct ShadingStats {
  uint64_t lookups = 0; // operations x captured lights they blend
  uint64_t operations = 0;
  uint64_t lost = 0;       // operations that see background only
  uint64_t tasks = 0;      // operations x the blocks they touch
  uint64_t taskRanks = 0;  // sum of the blocks' ranks over tasks
  uint64_t cacheHits = 0;  // tasks of operations all of whose blocks were in memory
  uint64_t blocksRead = 0; // from disk
  uint64_t bytesRead = 0;
};

// Executes parts as they are emitted, and in the end the operations that wait for the disk.
//
// Between begin and finish each block is fetched once; once for each 4096 where more wait, and once more if
// targets that see background only need it. The result has the same bits for any number of threads and any
// cache, and for all vector instructions but scalar, which rounds each product. Against executeReference
// (reference.h) it errs by less than (weights + K + tasks of the target + 21) 2^-24 times the sum of
// |weight| |tap| |w| |a| |e| over the target's terms, as BlockTerms has them: those at 16 bits are two;
// measured 2e-7 of it. Nobody else may use the cache meanwhile. Memory: 17 bytes an operation, 24 a target, 4
// for each operation that waits for a block and 8 for each of its blocks, some of which are noted several
// times, and 4096 blocks, or those of one part, beyond what the cache may hold.
class ShadingQueue {
public:
  // All must outlive the queue.
  ShadingQueue(codec::BlockCache& cache, ShadingStats& stats, const Progress& progress);

  // Starts on this many parts.
  void begin(size_t parts);

  // Takes a part, each number once; safe from many threads at a time. The part's arrays must last until
  // finish.
  void emit(size_t number, const ShadingPart& part);

  // The radiance of all targets of the first part, of the second, and so on. Throws Error as ViewFile::read.
  std::vector<Rgb> finish();

private:
  void executeWaiting(std::span<ExecutedPart> parts);
  void continueSurfaces();

  codec::BlockCache& cache_;
  ShadingStats& stats_;
  const Progress& progress_;
  Executor executor_;
  std::vector<ExecutedPart> parts_; // the first count_ are in use
  size_t count_ = 0;
  codec::CacheCounts before_;
};

// Executes parts that are complete, in one call.
std::vector<Rgb> execute(std::span<const ShadingPart> parts, codec::BlockCache& cache, ShadingStats& stats,
                         const Progress& progress = {});

// Executes one part.
inline std::vector<Rgb> execute(std::span<const ShadingOp> ops, const LightRows& rows, size_t targets,
                                codec::BlockCache& cache, ShadingStats& stats,
                                const Progress& progress = {}) {
  const ShadingPart part{ops, &rows, targets};
  return execute({&part, 1}, cache, stats, progress);
}

} // namespace surflect::shading
