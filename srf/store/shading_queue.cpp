// Symbols: e_k eigenimage, a_kl coefficient of light l, w_l light weight, K rank.
#include "srf/store/shading_queue.h"

#include "srf/store/look_up_kernel.h"
#include "surfel/error.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect {

namespace {

// The part of a bilinear interpolation that one stored block answers.
struct Tap {
  uint32_t block = 0;
  int texel = 0;
  float weight = 0;
};

struct Footprint {
  std::array<Tap, 4> taps;
  int count = 0;

  std::span<const Tap> all() const { return {taps.data(), static_cast<size_t>(count)}; }
};

// Taps on background dropped, the others renormalised; empty if none is left.
Footprint footprintOf(const ViewFile& view, float x, float y) {
  assert(std::isfinite(x) && std::isfinite(y));
  const int width = view.header().width, height = view.header().height;
  const float u = std::clamp(x - 0.5f, 0.f, static_cast<float>(width - 1));
  const float v = std::clamp(y - 0.5f, 0.f, static_cast<float>(height - 1));
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const float fx = u - static_cast<float>(i), fy = v - static_cast<float>(j);

  Footprint footprint;
  float kept = 0;
  BlockPosition position{-1, -1};
  std::optional<uint32_t> block; // at `position`; mostly the same for all four
  for (int corner = 0; corner < 4; ++corner) {
    const int right = corner & 1, down = corner >> 1;
    const float weight = (right ? fx : 1 - fx) * (down ? fy : 1 - fy);
    if (weight == 0) continue; // also keeps i + 1 and j + 1 inside the image
    const int tx = i + right, ty = j + down;
    const BlockPosition here{tx / blockSize, ty / blockSize};
    if (here != position) block = view.find(position = here);
    if (!block) continue;
    footprint.taps[footprint.count++] = {*block, ty % blockSize * blockSize + tx % blockSize, weight};
    kept += weight;
  }
  for (int t = 0; t < footprint.count; ++t) footprint.taps[t].weight /= kept;
  return footprint;
}

// The point between texel centres of a stored block that is nearest to (x, y), all in pixels; empty for a
// view that stores nothing. Of equals, the first in rings of blocks about the one that holds (x, y); no
// further ring can come nearer.
std::optional<Eigen::Vector2f> nearestStored(const ViewFile& view, float x, float y) {
  const ViewHeader& header = view.header();
  x = std::clamp(x, 0.5f, static_cast<float>(header.width) - 0.5f);
  y = std::clamp(y, 0.5f, static_cast<float>(header.height) - 0.5f);
  const int cx = static_cast<int>(x) / blockSize, cy = static_cast<int>(y) / blockSize;
  std::optional<Eigen::Vector2f> nearest;
  float least = std::numeric_limits<float>::infinity(); // squared
  const auto offer = [&](int bx, int by) {
    if (bx < 0 || by < 0 || bx >= header.blocksAcross() || by >= header.blocksDown() || !view.find({bx, by}))
      return;
    // Centres of its outermost texels; those beyond the image's border are not asked for.
    const auto inside = [](float value, int block, int size) {
      const int last = std::min((block + 1) * blockSize, size) - 1;
      return std::clamp(value, static_cast<float>(block * blockSize) + 0.5f, static_cast<float>(last) + 0.5f);
    };
    const Eigen::Vector2f here{inside(x, bx, header.width), inside(y, by, header.height)};
    const float distance = (here - Eigen::Vector2f(x, y)).squaredNorm();
    if (distance < least) least = distance, nearest = here;
  };
  const int rings = std::max(header.blocksAcross(), header.blocksDown());
  for (int ring = 0; ring < rings; ++ring) {
    const auto reach = static_cast<float>((ring - 1) * blockSize); // no block of the ring is nearer
    if (ring > 0 && reach * reach > least) break;
    for (int d = -ring; d <= ring; ++d) {
      offer(cx + d, cy - ring);
      offer(cx + d, cy + ring);
      if (std::abs(d) == ring) continue; // the corners are done
      offer(cx - ring, cy + d);
      offer(cx + ring, cy + d);
    }
  }
  return nearest;
}

// Calls visit(block) for each block of a footprint, once.
template <class Visit> void forEachBlock(const Footprint& footprint, Visit visit) {
  for (int t = 0; t < footprint.count; ++t) {
    const auto earlier = footprint.all().first(t);
    if (std::ranges::find(earlier, footprint.taps[t].block, &Tap::block) == earlier.end())
      visit(footprint.taps[t].block);
  }
}

// One operation in one block; its result goes to slots[slot].
struct Task {
  uint64_t key = 0; // view, block
  uint32_t op = 0, slot = 0;

  uint32_t view() const { return static_cast<uint32_t>(key >> 32); }
  uint32_t block() const { return static_cast<uint32_t>(key); }
  friend bool operator<(const Task& a, const Task& b) {
    return a.key != b.key ? a.key < b.key : a.slot < b.slot;
  }
};

// What operations do in which blocks. Results have a slot each, by operation and, of one, in the order of
// its taps.
struct Footprints {
  std::vector<uint32_t> firstSlot; // of each operation's; one more, for the end
  std::vector<Task> tasks;         // by slot
  std::vector<BlockTaps> taps;     // by slot
};

Footprints footprintsOf(std::span<const ShadingOp> ops, std::span<const ViewFile> views,
                        const Progress& progress) {
  constexpr size_t kOpsPerRun = 1024;
  struct Run {
    std::vector<Task> tasks;
    std::vector<BlockTaps> taps;
    uint32_t firstSlot = 0;
  };
  Footprints all;
  all.firstSlot.resize(ops.size() + 1);
  std::vector<Run> runs((ops.size() + kOpsPerRun - 1) / kOpsPerRun);
  const auto endOf = [&](size_t run) { return std::min(ops.size(), (run + 1) * kOpsPerRun); };
  tbb::parallel_for(size_t{0}, runs.size(), [&](size_t r) {
    progress.checkpoint();
    auto& [tasks, taps, firstSlot] = runs[r];
    tasks.reserve(2 * kOpsPerRun);
    taps.reserve(2 * kOpsPerRun);
    for (size_t i = r * kOpsPerRun; i < endOf(r); ++i) {
      const ShadingOp& op = ops[i];
      const Footprint footprint = footprintOf(views[op.view], op.x, op.y);
      forEachBlock(footprint, [&](uint32_t block) {
        BlockTaps ofBlock{};
        for (const Tap& tap : footprint.all()) {
          if (tap.block != block) continue;
          ofBlock.weights[ofBlock.count] = tap.weight;
          ofBlock.texels[ofBlock.count++] = static_cast<uint8_t>(tap.texel);
        }
        tasks.push_back({uint64_t{op.view} << 32 | block, static_cast<uint32_t>(i), 0});
        taps.push_back(ofBlock);
      });
      all.firstSlot[i + 1] = static_cast<uint32_t>(tasks.size());
    }
  });
  size_t slots = 0;
  for (Run& run : runs) {
    run.firstSlot = static_cast<uint32_t>(slots);
    slots += run.tasks.size();
  }
  if (std::max(slots, ops.size()) > std::numeric_limits<uint32_t>::max())
    throw Error("too many look-ups to be queued at once");
  all.tasks.resize(slots);
  all.taps.resize(slots);
  tbb::parallel_for(size_t{0}, runs.size(), [&](size_t r) {
    const uint32_t first = runs[r].firstSlot;
    for (size_t i = r * kOpsPerRun; i < endOf(r); ++i) all.firstSlot[i + 1] += first;
    for (uint32_t t = 0; t < runs[r].tasks.size(); ++t) {
      all.tasks[first + t] = runs[r].tasks[t];
      all.tasks[first + t].slot = first + t;
    }
    std::ranges::copy(runs[r].taps, all.taps.begin() + first);
  });
  return all;
}

bool isLost(std::span<const uint32_t> firstSlot, size_t op) { return firstSlot[op] == firstSlot[op + 1]; }

// The operations, with those of targets that see nothing but background moved to what is stored nearest;
// empty where there is no such target.
std::vector<ShadingOp> sighted(std::span<const ShadingOp> ops, std::span<const uint32_t> firstSlot,
                               std::span<const ViewFile> views, size_t targets, const Progress& progress) {
  std::vector<uint8_t> sees(targets), blind(targets);
  for (size_t i = 0; i < ops.size(); ++i) (isLost(firstSlot, i) ? blind : sees)[ops[i].target] = 1;
  for (size_t target = 0; target < targets; ++target) blind[target] = blind[target] && !sees[target];
  if (std::ranges::count(blind, 1) == 0) return {};
  std::vector<ShadingOp> moved(ops.begin(), ops.end());
  tbb::parallel_for(size_t{0}, moved.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    ShadingOp& op = moved[i];
    if (!blind[op.target]) return;
    if (const auto stored = nearestStored(views[op.view], op.x, op.y)) {
      op.x = stored->x();
      op.y = stored->y();
    }
  });
  return moved;
}

// What remains of a target when some of its operations are lost.
struct Coverage {
  double all = 0, kept = 0; // sums of weights

  float scale() const { return all == kept || kept == 0 ? 1.f : static_cast<float>(all / kept); }
};

} // namespace

std::vector<Rgb> execute(std::span<const ShadingOp> ops, std::span<const LightWeight> rows, size_t targets,
                         BlockCache& cache, ShadingStats& stats, const Progress& progress, Simd simd) {
  const std::span<const ViewFile> views = cache.views();
  assert(std::ranges::all_of(ops, [&](const ShadingOp& op) {
    return op.view < views.size() && op.target < targets && op.rowBegin <= op.rowEnd &&
           op.rowEnd <= rows.size();
  }));
  const CacheCounts before = cache.counts();
  Footprints footprints = footprintsOf(ops, views, progress);
  std::vector<uint32_t>& firstSlot = footprints.firstSlot;
  for (size_t i = 0; i < ops.size(); ++i) {
    stats.lookups += ops[i].rowEnd - ops[i].rowBegin;
    stats.lost += isLost(firstSlot, i);
  }
  const std::vector<ShadingOp> moved = sighted(ops, firstSlot, views, targets, progress);
  if (!moved.empty()) {
    ops = moved;
    footprints = footprintsOf(ops, views, progress);
  }
  std::vector<Task>& tasks = footprints.tasks;
  tbb::parallel_sort(tasks); // no two compare equal: one order only

  std::vector<size_t> runs; // of tasks in one block: where each begins; one more, for the end
  for (size_t t = 0; t < tasks.size(); ++t)
    if (t == 0 || tasks[t].key != tasks[t - 1].key) runs.push_back(t);
  runs.push_back(tasks.size());

  std::vector<Rgb> slots(tasks.size());
  std::vector<uint64_t> ranks(runs.size() - 1);
  const LookUpKernel lookUp = lookUpKernel(simd);
  using Runs = tbb::blocked_range<size_t>;
  tbb::parallel_for(Runs(0, runs.size() - 1), [&](const Runs& part) {
    for (size_t r = part.begin(); r < part.end(); ++r) {
      progress.checkpoint();
      const Task& first = tasks[runs[r]];
      const std::shared_ptr<const Block> block = cache.get(first.view(), first.block());
      ranks[r] = static_cast<uint64_t>(block->rank);
      for (size_t t = runs[r]; t < runs[r + 1]; ++t) {
        const ShadingOp& op = ops[tasks[t].op];
        float rgb[3];
        lookUp({block->basis.data(), block->coefficients.data(), static_cast<size_t>(block->stride),
                rows.data() + op.rowBegin, op.rowEnd - op.rowBegin},
               footprints.taps[tasks[t].slot], rgb);
        slots[tasks[t].slot] = op.weight * Rgb{rgb[0], rgb[1], rgb[2]};
      }
    }
  });

  std::vector<Rgb> radiance(targets);
  std::vector<Coverage> coverage(targets);
  for (size_t i = 0; i < ops.size(); ++i) {
    coverage[ops[i].target].all += ops[i].weight;
    if (!isLost(firstSlot, i)) coverage[ops[i].target].kept += ops[i].weight;
    for (size_t s = firstSlot[i]; s < firstSlot[i + 1]; ++s)
      radiance[ops[i].target] = radiance[ops[i].target] + slots[s];
  }
  for (size_t target = 0; target < targets; ++target)
    radiance[target] = coverage[target].scale() * radiance[target];

  const CacheCounts after = cache.counts();
  stats.operations += ops.size();
  stats.tasks += tasks.size();
  for (size_t r = 0; r < ranks.size(); ++r) stats.taskRanks += ranks[r] * (runs[r + 1] - runs[r]);
  stats.blocksRead += after.reads - before.reads;
  stats.bytesRead += after.bytesRead - before.bytesRead;
  stats.cacheHits += after.hits - before.hits;
  return radiance;
}

namespace {

// Reflectance image (view, light) at one texel; empty where it is background.
std::optional<Eigen::Vector3d> texelRadiance(BlockCache& cache, uint32_t view, uint32_t light, int x, int y) {
  const std::optional<uint32_t> number = cache.views()[view].find({x / blockSize, y / blockSize});
  if (!number) return std::nullopt;
  const std::shared_ptr<const Block> block = cache.get(view, *number);
  const float* e = block->texel(y % blockSize * blockSize + x % blockSize);
  const float* a = block->light(light);
  Eigen::Vector3d radiance = Eigen::Vector3d::Zero();
  for (int channel = 0; channel < 3; ++channel)
    for (int k = 0; k < block->rank; ++k) radiance[channel] += double{a[k]} * e[channel * block->stride + k];
  return radiance;
}

// Bilinear; empty where all four texels are background.
std::optional<Eigen::Vector3d> lookUp(BlockCache& cache, uint32_t view, uint32_t light, double x, double y) {
  const ViewHeader& header = cache.views()[view].header();
  const double left = std::floor(x - 0.5), top = std::floor(y - 0.5);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const double tx : {left, left + 1}) {
    for (const double ty : {top, top + 1}) {
      const double weight = (1 - std::abs(x - 0.5 - tx)) * (1 - std::abs(y - 0.5 - ty));
      if (weight == 0) continue;
      const auto radiance =
          texelRadiance(cache, view, light, static_cast<int>(std::clamp<double>(tx, 0, header.width - 1)),
                        static_cast<int>(std::clamp<double>(ty, 0, header.height - 1)));
      if (!radiance) continue;
      sum += weight * *radiance;
      weights += weight;
    }
  }
  if (weights == 0) return std::nullopt;
  return Eigen::Vector3d(sum / weights);
}

// The point of the area between the centres of a block's texels that is nearest, over all stored blocks.
std::optional<Eigen::Vector2d> nearestTexel(BlockCache& cache, uint32_t view, double x, double y) {
  const ViewFile& file = cache.views()[view];
  const auto clamped = [](double value, int block, int size) {
    return std::clamp(value, block * blockSize + 0.5, std::min((block + 1) * blockSize, size) - 0.5);
  };
  const Eigen::Vector2d from{std::clamp(x, 0.5, file.header().width - 0.5),
                             std::clamp(y, 0.5, file.header().height - 0.5)};
  std::optional<Eigen::Vector2d> nearest;
  for (uint32_t number = 0; number < file.blockCount(); ++number) {
    const BlockPosition block = file.position(number);
    const Eigen::Vector2d here{clamped(from.x(), block.x, file.header().width),
                               clamped(from.y(), block.y, file.header().height)};
    if (!nearest || (here - from).squaredNorm() < (*nearest - from).squaredNorm()) nearest = here;
  }
  return nearest;
}

} // namespace

std::vector<Eigen::Vector3d> executeReference(std::span<const ShadingOp> ops,
                                              std::span<const LightWeight> rows, size_t targets,
                                              BlockCache& cache) {
  std::vector<Eigen::Vector3d> radiance(targets, Eigen::Vector3d::Zero());
  std::vector<double> all(targets), kept(targets);
  const auto add = [&](const ShadingOp& op, double x, double y) {
    if (!lookUp(cache, op.view, 0, x, y)) return;
    kept[op.target] += op.weight;
    for (const LightWeight& w : rows.subspan(op.rowBegin, op.rowEnd - op.rowBegin)) {
      const Eigen::Vector3d omega = op.weight * Eigen::Vector3d(w.weight.r, w.weight.g, w.weight.b);
      radiance[op.target] += omega.cwiseProduct(*lookUp(cache, op.view, w.light, x, y));
    }
  };
  std::vector<bool> isBlind(targets, true);
  for (const ShadingOp& op : ops) {
    all[op.target] += op.weight;
    if (lookUp(cache, op.view, 0, op.x, op.y)) isBlind[op.target] = false;
  }
  for (const ShadingOp& op : ops) {
    if (!isBlind[op.target])
      add(op, op.x, op.y);
    else if (const auto texel = nearestTexel(cache, op.view, op.x, op.y))
      add(op, texel->x(), texel->y());
  }
  for (size_t target = 0; target < targets; ++target)
    if (kept[target] != 0) radiance[target] *= all[target] / kept[target];
  return radiance;
}

} // namespace surflect
