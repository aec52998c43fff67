// Deferred shading: a queue of many look-ups into reflectance images. Blocks that are not in memory are read
// in the order in which they lie on disk [Weyrich 2005, §5.3]. Look-ups with resident blocks are executed
// first, in their own order, in which neighbours share lights and blocks.
//
//   radiance[target] = sum over its operations of
//     weight * sum over bilinear taps of tap * sum_k (sum_l w_l a_kl) e_k(texel),   per channel, where
//
//   w_l = sum over the lights of its row of colour * weight of the captured light l.
//
// Background: taps in blocks that are not stored are dropped, and the others renormalised. An operation
// without taps is lost; the target's other operations are scaled by (sum of all weights) / (sum of weights
// not lost). If all operations of a target are lost, each is repeated at the nearest texel that its view
// stores: where silhouette and mesh disagree, the surface is thus continued instead of turning black. A
// target is 0 only if its views store nothing.
#pragma once

#include "srf/codec/block_cache.h"
#include "srf/shading/executor.h"
#include "srf/shading/plan.h"
#include "surfel/base/time.h"
#include "surfel/math/rgb.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::shading {

// Counts of the shading queue, accumulated over calls.
struct ShadingStats {
  uint64_t lookups = 0; // operations times the captured lights they blend
  uint64_t operations = 0;
  uint64_t lost = 0;       // operations that see only background
  uint64_t tasks = 0;      // operations times the blocks they touch
  uint64_t taskRanks = 0;  // ranks of the blocks, summed over tasks
  uint64_t cacheHits = 0;  // tasks of operations with all blocks in memory
  uint64_t blocksRead = 0; // from disk
  uint64_t bytesRead = 0;
};

// Executes parts as they are emitted, and finally the operations that wait for the disk.
//
// Between begin and finish each block is fetched once, except that more than 4096 waiting blocks are fetched
// in several groups, and that targets which see only background may need a block again. The result has the
// same bits for any number of threads, any cache, and any instruction set other than scalar, which rounds
// each product.
//
// Compared with executeReference (reference.h), the error is below (weights + K + tasks of the target + 21)
// 2^-24 times the sum of |weight| |tap| |w| |a| |e| over the target's terms, where 16-bit terms count twice
// as in BlockTerms.
//
// Nothing else may use the cache between begin and finish. Memory: 17 bytes per operation, 24 per target, 4
// for each waiting operation, 8 for each of its blocks (some more than once), and 4096 blocks, or those of
// one part, beyond the cache's budget.
class ShadingQueue {
public:
  // The arguments must outlive the queue.
  ShadingQueue(codec::BlockCache& cache, ShadingStats& stats, const Progress& progress);

  // Starts a run of `parts` parts.
  void begin(size_t parts);

  // Takes the part of this number. Call once for each number. Safe from many threads at once. The part's
  // arrays must last until finish.
  void emit(size_t number, const ShadingPart& part);

  // Returns the radiance of all targets, part by part. Throws Error as ViewFile::read.
  std::vector<Rgb> finish();

private:
  void executeWaiting(std::span<ExecutedPart> parts);
  void retryLostTargets();

  codec::BlockCache& cache_;
  ShadingStats& stats_;
  const Progress& progress_;
  Executor executor_;
  std::vector<ExecutedPart> parts_; // the first count_ are in use
  size_t count_ = 0;
  codec::CacheCounts before_;
};

// Executes complete parts in one call.
std::vector<Rgb> execute(std::span<const ShadingPart> parts, codec::BlockCache& cache, ShadingStats& stats,
                         const Progress& progress = {});

// Executes a single part.
inline std::vector<Rgb> execute(std::span<const ShadingOp> ops, const weights::LightRows& rows,
                                size_t targets, codec::BlockCache& cache, ShadingStats& stats,
                                const Progress& progress = {}) {
  const ShadingPart part{ops, &rows, targets};
  return execute({&part, 1}, cache, stats, progress);
}

} // namespace surflect::shading
