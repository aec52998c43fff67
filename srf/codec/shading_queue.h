// Deferred shading: many look-ups into reflectance images. Blocks that they wait for are read in the order in
// which they lie on disk [Weyrich 2005, §5.3]; look-ups are answered in their own order, in which neighbours
// share lights and blocks, first those whose blocks are in memory.
#pragma once

#include "srf/codec/answerer.h"
#include "srf/codec/block_cache.h"
#include "srf/codec/shading_part.h"
#include "surfel/base/progress.h"
#include "surfel/math/rgb.h"
#include "surfel/math/simd.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::codec {

// Counts add up over calls.
struct ShadingStats {
  uint64_t lookups = 0; // operations x captured lights they blend
  uint64_t operations = 0;
  uint64_t lost = 0;       // operations that saw background only
  uint64_t tasks = 0;      // operations x the blocks they touch
  uint64_t taskRanks = 0;  // sum of the blocks' ranks over tasks
  uint64_t cacheHits = 0;  // tasks of operations all of whose blocks were in memory
  uint64_t blocksRead = 0; // from disk
  uint64_t bytesRead = 0;
};

// Answers parts as they come, and in the end what has to wait for the disk.
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
//
// Between begin and finish each block is fetched once, or once for each 4096 where more than so many wait,
// and once more if targets that see background only are left to it. The result has the same bits for any
// number of threads and any cache, and for all vector instructions but scalar, which rounds each product.
// Against executeReference it errs by less than (weights + K + tasks of the target + 21) 2^-24 times the sum
// of |weight| |tap| |w| |a| |e| over the target's terms, as BlockTerms has them: those at 16 bits are two;
// measured 2e-7 of it. Nobody else may use the cache meanwhile. Memory: 17 bytes an operation, 24 a target, 4
// for each operation that waits for a block and 8 for each of its blocks, some of which are noted several
// times, and 4096 blocks, or those of one part, beyond what the cache may hold.
class ShadingQueue {
public:
  // All must outlive the queue.
  ShadingQueue(BlockCache& cache, ShadingStats& stats, const Progress& progress, Simd simd);

  // So many parts will be asked.
  void begin(size_t parts);

  // Each of them once; by many threads at a time. What the part points at must last until finish.
  void ask(size_t number, const ShadingPart& part);

  // The radiance of all targets of the first part, of the second, and so on. Throws Error as ViewFile::read.
  std::vector<Rgb> finish();

private:
  void answerWaiting(std::span<AnsweredPart> parts);
  void answerBlind();

  BlockCache& cache_;
  ShadingStats& stats_;
  const Progress& progress_;
  Answerer answerer_;
  std::vector<AnsweredPart> parts_; // those begun, and memory of more
  size_t count_ = 0;
  CacheCounts before_;
};

// The same for parts that are there already.
std::vector<Rgb> execute(std::span<const ShadingPart> parts, BlockCache& cache, ShadingStats& stats,
                         const Progress& progress = {}, Simd simd = bestSimd());

// Of one part.
inline std::vector<Rgb> execute(std::span<const ShadingOp> ops, const LightRows& rows, size_t targets,
                                BlockCache& cache, ShadingStats& stats, const Progress& progress = {},
                                Simd simd = bestSimd()) {
  const ShadingPart part{ops, &rows, targets};
  return execute({&part, 1}, cache, stats, progress, simd);
}

// The same as the paper states it, in double precision: one look-up for one surfel, camera and light after
// the other, unsorted. Slow; the yardstick. Entries are r, g, b.
std::vector<Eigen::Vector3d> executeReference(std::span<const ShadingOp> ops, const LightRows& rows,
                                              size_t targets, BlockCache& cache);

} // namespace surflect::codec
