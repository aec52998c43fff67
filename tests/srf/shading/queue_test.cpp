#include "srf/shading/queue.h"

#include "srf/shading/reference.h"
#include "tests/srf/codec/synthetic.h"
#include "tests/support/each_simd.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <iterator>
#include <set>

namespace surflect::shading {
namespace {

using codec::synthetic::glossySphere;

constexpr int size = 72, lights = 12, views = 3;
constexpr size_t wholeCache = 1 << 30;

// A row of captured lights, each with its own colour.
weights::LightRows rowsOf(const std::vector<std::pair<uint32_t, Rgb>>& lit) {
  weights::LightRows rows;
  for (const auto& [light, color] : lit) rows.add(light, color);
  return rows;
}

struct Queue {
  std::vector<ShadingOp> ops;
  weights::LightRows rows;
  size_t targets = 0;
};

class ShadingQueueTest : public ::testing::Test {
protected:
  ShadingQueueTest() {
    for (int v = 0; v < views; ++v) {
      const std::filesystem::path path = folder_ / (std::to_string(v) + ".view");
      const codec::ReflectanceStack stack = glossySphere(size, lights, 1.f + static_cast<float>(v));
      writeFileAtomically(path, codec::encodeView(stack, {.tolerance = 0.005}).file);
      views_.emplace_back(path);
    }
  }

  // Three views and 1 to 5 lights for each target, some positions outside the object or the image.
  Queue randomQueue(size_t targets, unsigned seed) const {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<float> position(-2, size + 2), weight(0, 1);
    Queue queue;
    queue.targets = targets;
    for (uint32_t target = 0; target < targets; ++target) {
      const auto begin = static_cast<uint32_t>(queue.rows.lights.size());
      for (uint32_t l = 0; l < 1 + target % 5; ++l) {
        const auto first = static_cast<uint32_t>(queue.rows.weights.size());
        for (uint32_t i = 0; i < 1 + l % 4; ++i)
          queue.rows.weights.push_back({static_cast<uint32_t>(generator() % lights), weight(generator)});
        queue.rows.lights.push_back({{weight(generator), weight(generator), weight(generator)},
                                     first,
                                     static_cast<uint32_t>(queue.rows.weights.size())});
      }
      const auto end = static_cast<uint32_t>(queue.rows.lights.size());
      for (uint32_t v = 0; v < views; ++v)
        queue.ops.push_back(
            {target, v, position(generator), position(generator), weight(generator), begin, end});
    }
    return queue;
  }

  std::vector<Rgb> executed(const Queue& queue, size_t budget = wholeCache) const {
    codec::BlockCache cache(views_, budget);
    ShadingStats stats;
    return execute(queue.ops, queue.rows, queue.targets, cache, stats);
  }
  std::vector<Eigen::Vector3d> reference(const Queue& queue) const {
    codec::BlockCache cache(views_, wholeCache);
    return executeReference(queue.ops, queue.rows, queue.targets, cache);
  }
  // Executes one operation for one target.
  Rgb shaded(float x, float y, const std::vector<std::pair<uint32_t, Rgb>>& lit, uint32_t view = 0) const {
    return executed({{{0, view, x, y, 1, 0, static_cast<uint32_t>(lit.size())}}, rowsOf(lit), 1})[0];
  }

  // Scale of an operation's error: |weight| |w| |a| |e|, summed over all terms.
  Eigen::Vector3d magnitude(const Queue& queue, const ShadingOp& op) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weights = 0;
    const codec::ViewFile& view = views_[op.view];
    for (const int right : {0, 1}) {
      for (const int down : {0, 1}) {
        const double left = std::floor(op.x - 0.5), top = std::floor(op.y - 0.5);
        const double tap =
            std::abs(1 - right - (op.x - 0.5 - left)) * std::abs(1 - down - (op.y - 0.5 - top));
        const int x = std::clamp(static_cast<int>(left) + right, 0, size - 1);
        const int y = std::clamp(static_cast<int>(top) + down, 0, size - 1);
        const auto number = view.find({x / codec::blockSize, y / codec::blockSize});
        if (!number) continue;
        weights += tap;
        const codec::Block block = view.read(*number);
        const int8_t* e = block.texel(y % codec::blockSize * codec::blockSize + x % codec::blockSize);
        for (uint32_t i = op.rowBegin; i < op.rowEnd; ++i) {
          const auto& [color, begin, end] = queue.rows.lights[i];
          for (const auto& [light, weight] : std::span(queue.rows.weights).subspan(begin, end - begin))
            for (int k = 0; k < block.stride; ++k) {
              const double a = tap * std::abs(weight * block.light(light)[k]);
              sum[0] += a * std::abs(color.r * e[k]);
              sum[1] += a * std::abs(color.g * e[block.stride + k]);
              sum[2] += a * std::abs(color.b * e[2 * block.stride + k]);
            }
        }
      }
    }
    return weights > 0 ? Eigen::Vector3d(op.weight / weights * sum) : sum;
  }

  image::TemporaryFolder folder_;
  std::vector<codec::ViewFile> views_;
};

TEST_F(ShadingQueueTest, EqualsTheReferenceInAnyOrderOfOperations) {
  Queue queue = randomQueue(400, 1);
  const auto expected = reference(queue);
  std::vector<Eigen::Vector3d> bound(queue.targets, Eigen::Vector3d::Zero());
  std::vector<double> all(queue.targets), kept(queue.targets);
  for (const ShadingOp& op : queue.ops) {
    const Eigen::Vector3d ofOp = magnitude(queue, op);
    bound[op.target] += ofOp;
    all[op.target] += op.weight;
    if (ofOp.norm() > 0) kept[op.target] += op.weight;
  }
  for (size_t t = 0; t < queue.targets; ++t) {
    if (kept[t] > 0)
      bound[t] *= all[t] / kept[t];
    else
      bound[t] = 10 * expected[t]; // sees only background, and is repeated elsewhere
  }
  EXPECT_GT(std::ranges::count(kept, 0), 3);

  std::mt19937 generator(2);
  for (int order = 0; order < 3; ++order) {
    const auto radiance = executed(queue);
    for (size_t t = 0; t < queue.targets; ++t) {
      const Eigen::Vector3d found(radiance[t].r, radiance[t].g, radiance[t].b);
      EXPECT_LE(((found - expected[t]).cwiseAbs() - 4e-7 * bound[t]).maxCoeff(), 0) << t;
    }
    std::ranges::shuffle(queue.ops, generator);
  }
}

TEST_F(ShadingQueueTest, SameBitsForAnyNumberOfThreads) {
  const Queue queue = randomQueue(2000, 3);
  const auto expected = executed(queue);
  for (const int threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    tbb::task_arena arena(threads);
    arena.execute([&] { EXPECT_EQ(executed(queue), expected) << threads; });
  }
}

// Runs from disk, then from memory.
TEST_F(ShadingQueueTest, PartsHaveTheSameBitsForAnyNumberOfThreads) {
  std::vector<Queue> queues;
  for (unsigned i = 0; i < 20; ++i) queues.push_back(randomQueue(150, i));
  std::vector<ShadingPart> parts;
  std::vector<Rgb> expected;
  for (const Queue& queue : queues) {
    parts.push_back({queue.ops, &queue.rows, queue.targets});
    std::ranges::copy(executed(queue), std::back_inserter(expected));
  }
  for (const int threads : {1, 2, 4})
    tbb::task_arena(threads).execute([&] {
      codec::BlockCache cache(views_, wholeCache);
      ShadingStats stats;
      for (int call = 0; call < 2; ++call) EXPECT_EQ(execute(parts, cache, stats), expected) << threads;
      EXPECT_GE(stats.cacheHits, stats.tasks / 2);
    });
}

TEST_F(ShadingQueueTest, AllVectorInstructionsButScalarGiveTheSameBits) {
  const Queue queue = randomQueue(2000, 5);
  const auto best = executed(queue), scalar = inSimd(Simd::scalar, [&] { return executed(queue); });
  for (const Simd simd : EachSimd())
    if (simd != Simd::scalar) {
      EXPECT_EQ(executed(queue), best) << nameOf(simd);
    }
  for (size_t t = 0; t < queue.targets; ++t) {
    EXPECT_NEAR(scalar[t].r, best[t].r, 1.9e-6) << t;
    EXPECT_NEAR(scalar[t].g, best[t].g, 1.9e-6) << t;
    EXPECT_NEAR(scalar[t].b, best[t].b, 1.9e-6) << t;
  }
}

TEST_F(ShadingQueueTest, PartsHaveTargetsAndRowsOfTheirOwn) {
  const Queue first = randomQueue(300, 7), second = randomQueue(500, 8);
  std::vector<Rgb> expected = executed(first);
  for (const Rgb& radiance : executed(second)) expected.push_back(radiance);
  const Queue nothing;
  std::vector<ShadingPart> parts;
  for (const Queue* queue : {&first, &nothing, &second})
    parts.push_back({queue->ops, &queue->rows, queue->targets});
  for (const size_t budget : {size_t{0}, wholeCache}) {
    codec::BlockCache cache(views_, budget);
    ShadingStats stats;
    for (int call = 0; call < 2; ++call) EXPECT_EQ(execute(parts, cache, stats), expected);
    EXPECT_EQ(stats.operations, 2 * (first.ops.size() + second.ops.size()));
  }
}

TEST_F(ShadingQueueTest, SameBitsForAnyCache) {
  const Queue queue = randomQueue(2000, 4);
  size_t image = 0; // decoded size of one view
  for (uint32_t b = 0; b < views_[0].blockCount(); ++b) image += views_[0].read(b).memory();
  const auto expected = executed(queue, wholeCache);
  EXPECT_EQ(executed(queue, 0), expected);
  EXPECT_EQ(executed(queue, views_[0].read(20).memory()), expected);
  EXPECT_EQ(executed(queue, 3 * image), expected);
}

// Includes a black block, which has no terms.
TEST_F(ShadingQueueTest, SameBitsWhateverIsInMemoryBefore) {
  codec::ReflectanceStack stack = glossySphere(size, lights, 1);
  for (image::Image& light : stack.lights)
    for (int y = 32; y < 40; ++y) std::fill_n(light.at(32, y).data(), 3 * codec::blockSize, 0.f);
  writeFileAtomically(folder_ / "black.view", codec::encodeView(stack, {.tolerance = 0.005}).file);
  views_.emplace_back(folder_ / "black.view");
  ASSERT_EQ(views_[views].read(*views_[views].find({4, 4})).rank, 0);
  Queue queue = randomQueue(1000, 6);
  for (ShadingOp& op : queue.ops)
    if (op.target % 2 == 0) op.view = (op.view + 1) % (views + 1);
  size_t image = 0; // decoded size of one view
  for (uint32_t b = 0; b < views_[0].blockCount(); ++b) image += views_[0].read(b).memory();
  const auto expected = executed(queue);
  for (const size_t budget : {size_t{0}, views_[0].read(20).memory(), image, 3 * image, wholeCache}) {
    codec::BlockCache cache(views_, budget);
    for (int call = 0; call < 3; ++call) {
      ShadingStats stats;
      EXPECT_EQ(execute(queue.ops, queue.rows, queue.targets, cache, stats), expected)
          << budget << ", " << call;
      if (call == 0) continue;
      if (budget == 0) {
        EXPECT_EQ(stats.cacheHits, 0u);
      } else if (budget >= image) {
        EXPECT_GT(stats.cacheHits, 0u);
      }
      EXPECT_EQ(stats.cacheHits == stats.tasks, budget == wholeCache);
    }
  }
}

TEST_F(ShadingQueueTest, AnOperationWaitsForAllItsBlocks) {
  const Queue queue{{{0, 0, 40.0f, 36.5f, 1, 0, 1}}, rowsOf({{7, {1, 1, 1}}}), 1};
  for (const int there : {4, 5}) {
    codec::BlockCache cache(views_, wholeCache);
    cache.get(0, *views_[0].find({there, 4}));
    ShadingStats stats;
    EXPECT_EQ(execute(queue.ops, queue.rows, 1, cache, stats), executed(queue));
    EXPECT_EQ(stats.blocksRead, 1u);
    EXPECT_EQ(stats.cacheHits, 0u);
  }
}

TEST_F(ShadingQueueTest, ReadsEachBlockOnceACallHoweverSmallTheCache) {
  Queue queue = randomQueue(3000, 5);
  for (uint32_t target = 0; target < queue.targets; ++target) // no target sees only background
    queue.ops.push_back({target, 0, 36.2f, 30.7f, 1, 0, 1});
  for (const size_t budget : {size_t{0}, wholeCache}) {
    codec::BlockCache cache(views_, budget);
    ShadingStats stats;
    execute(queue.ops, queue.rows, queue.targets, cache, stats);
    uint64_t blocks = 0, bytes = 0;
    for (const codec::ViewFile& view : views_) {
      blocks += view.blockCount(); // this many operations touch all blocks
      for (uint32_t b = 0; b < view.blockCount(); ++b) bytes += view.storedBytes(b);
    }
    EXPECT_EQ(stats.blocksRead, blocks);
    EXPECT_EQ(stats.bytesRead, bytes);
    const ShadingStats first = stats;
    EXPECT_EQ(first.cacheHits, 0u);
    execute(queue.ops, queue.rows, queue.targets, cache, stats);
    EXPECT_EQ(stats.blocksRead, budget == 0 ? 2 * blocks : blocks);
    EXPECT_EQ(stats.cacheHits, budget == 0 ? 0 : first.tasks);
  }
}

TEST_F(ShadingQueueTest, MoreBlocksThanAreFetchedAtOnceGiveTheSameBits) {
  constexpr int kSide = 960, kParts = 5;
  writeFileAtomically(folder_ / "large.view",
                      codec::encodeView(glossySphere(kSide, 2), {.tolerance = 0.1}).file);
  std::vector<codec::ViewFile> large;
  large.emplace_back(folder_ / "large.view");
  ASSERT_GT(large[0].blockCount(), 9000u);
  std::vector<std::vector<ShadingOp>> ops(kParts);
  for (uint32_t block = 0; block < large[0].blockCount(); ++block) {
    const auto [x, y] = large[0].position(block);
    auto& ofPart = ops[block % kParts];
    ofPart.push_back({static_cast<uint32_t>(ofPart.size()), 0, 8.f * static_cast<float>(x) + 4,
                      8.f * static_cast<float>(y) + 4, 1, 0, 1});
  }
  const weights::LightRows rows = rowsOf({{1, {1, 0.5f, 0.25f}}});
  std::vector<ShadingPart> parts;
  for (const auto& ofPart : ops) parts.push_back({ofPart, &rows, ofPart.size()});
  const auto shaded = [&](codec::BlockCache& cache, ShadingStats& stats) {
    return execute(parts, cache, stats);
  };
  codec::BlockCache none(large, 0), all(large, wholeCache);
  ShadingStats cold, warm;
  const std::vector<Rgb> expected = shaded(all, warm);
  EXPECT_EQ(shaded(none, cold), expected);
  EXPECT_EQ(cold.blocksRead, large[0].blockCount());
  EXPECT_EQ(shaded(all, warm), expected);
  EXPECT_EQ(warm.blocksRead, large[0].blockCount());
  EXPECT_EQ(warm.tasks, 2 * cold.tasks);
  EXPECT_EQ(warm.taskRanks, 2 * cold.taskRanks);
}

TEST_F(ShadingQueueTest, CountsOperationsLightsTasksAndLosses) {
  const weights::LightRows rows = rowsOf({4, {0, Rgb{1, 1, 1}}});
  const std::vector<ShadingOp> ops = {
      {0, 0, 36.5f, 36.5f, 1, 0, 4}, // on a texel
      {0, 1, 40.0f, 36.5f, 1, 0, 3}, // between two blocks
      {0, 2, 40.0f, 40.0f, 1, 0, 2}, // between four
      {0, 2, 1.0f, 1.0f, 1, 0, 1},   // background
  };
  codec::BlockCache cache(views_, wholeCache);
  ShadingStats stats;
  execute(ops, rows, 1, cache, stats);
  const ShadingStats cold = stats;
  EXPECT_EQ(stats.operations, 4u);
  EXPECT_EQ(stats.lookups, 10u);
  EXPECT_EQ(stats.tasks, 7u);
  EXPECT_EQ(stats.lost, 1u);
  EXPECT_EQ(stats.blocksRead, 7u);
  const auto rank = [&](uint32_t view, int bx, int by) {
    return static_cast<uint64_t>(views_[view].read(*views_[view].find({bx, by})).rank);
  };
  EXPECT_EQ(stats.taskRanks, rank(0, 4, 4) + rank(1, 4, 4) + rank(1, 5, 4) + rank(2, 4, 4) + rank(2, 5, 4) +
                                 rank(2, 4, 5) + rank(2, 5, 5));

  stats = {};
  execute(ops, rows, 1, cache, stats); // all blocks are in memory
  EXPECT_EQ(stats.operations, cold.operations);
  EXPECT_EQ(stats.lookups, cold.lookups);
  EXPECT_EQ(stats.tasks, cold.tasks);
  EXPECT_EQ(stats.taskRanks, cold.taskRanks);
  EXPECT_EQ(stats.lost, cold.lost);
  EXPECT_EQ(stats.cacheHits, cold.tasks);
  EXPECT_EQ(stats.blocksRead, 0u);
}

// A blind operation is executed twice, at its own position and at the nearest stored one.
TEST_F(ShadingQueueTest, CountsTheOperationsOfABlindTargetOnce) {
  const weights::LightRows rows = rowsOf({3, {0, Rgb{1, 1, 1}}});
  const std::vector<ShadingOp> ops = {{0, 0, 36.5f, 36.5f, 1, 0, 3}, {1, 0, 1.0f, 1.0f, 1, 0, 2}};
  codec::BlockCache cache(views_, wholeCache);
  for (const bool isWarm : {false, true}) {
    ShadingStats stats;
    execute(ops, rows, 2, cache, stats);
    EXPECT_EQ(stats.operations, 2u) << isWarm;
    EXPECT_EQ(stats.lookups, 5u) << isWarm;
    EXPECT_EQ(stats.lost, 1u) << isWarm;
    EXPECT_EQ(stats.tasks, 2u) << isWarm;
    EXPECT_EQ(stats.cacheHits, isWarm ? 2u : 0u);
  }
}

TEST_F(ShadingQueueTest, TexelCentresReturnTheStoredTexel) {
  const codec::ReflectanceStack stack = glossySphere(size, lights, 1);
  for (int x = 20; x < 52; ++x) {
    const Rgb radiance = shaded(static_cast<float>(x) + 0.5f, 36.5f, {{7, {1, 1, 1}}});
    const auto pixel = stack.lights[7].at(x, 36);
    EXPECT_NEAR(radiance.r, pixel[0], 0.015);
    EXPECT_NEAR(radiance.g, pixel[1], 0.015);
    EXPECT_NEAR(radiance.b, pixel[2], 0.015);
  }
}

TEST_F(ShadingQueueTest, LookUpIsLinearBetweenTexelCentresEvenAcrossBlocks) {
  const std::vector<std::pair<uint32_t, Rgb>> lit = {{7, {1, 1, 1}}};
  for (const float x : {30.5f, 31.5f, 39.5f, 40.5f}) { // blocks meet at 32 and 40
    const Rgb left = shaded(x, 36.5f, lit), right = shaded(x + 1, 36.5f, lit);
    for (const float t : {0.25f, 0.5f, 0.75f}) {
      const Rgb between = (1 - t) * left + t * right;
      EXPECT_NEAR(shaded(x + t, 36.5f, lit).g, between.g, 2e-7f) << x << " + " << t;
    }
  }
}

TEST_F(ShadingQueueTest, PositionsOutsideTheImageAreClamped) {
  codec::ReflectanceStack stack = glossySphere(16, 1);
  std::ranges::fill(stack.alpha.values, 1.f);
  for (int i = 0; i < 16 * 16 * 3; ++i) stack.lights[0].values[i] = static_cast<float>(i % 97);
  writeFileAtomically(folder_ / "full.view", codec::encodeView(stack, {.tolerance = 0}).file);
  views_.clear();
  views_.emplace_back(folder_ / "full.view");
  const std::vector<std::pair<uint32_t, Rgb>> lit = {{0, {1, 1, 1}}};
  EXPECT_EQ(shaded(-5, 8.5f, lit), shaded(0.5f, 8.5f, lit));
  EXPECT_EQ(shaded(1e30f, 8.5f, lit), shaded(15.5f, 8.5f, lit));
  EXPECT_EQ(shaded(3.25f, 16, lit), shaded(3.25f, 15.5f, lit));
  EXPECT_NE(shaded(3.25f, 15.5f, lit), shaded(3.25f, 14.5f, lit));
}

TEST_F(ShadingQueueTest, LightsAddUpAndWeightsMultiply) {
  const Rgb a = shaded(36.2f, 30.7f, {{2, {1, 1, 1}}}), b = shaded(36.2f, 30.7f, {{5, {1, 1, 1}}});
  const Rgb both = shaded(36.2f, 30.7f, {{2, {2, 0, 1}}, {5, {0, 3, 0.5f}}});
  EXPECT_NEAR(both.r, 2 * a.r, 2e-7f);
  EXPECT_NEAR(both.g, 3 * b.g, 2e-7f);
  EXPECT_NEAR(both.b, a.b + 0.5f * b.b, 2e-7f);
}

// Taps on background are dropped, so that a constant object is constant up to its silhouette and beyond.
TEST_F(ShadingQueueTest, BackgroundNeverMixesIn) {
  codec::ReflectanceStack stack = glossySphere(size, 1);
  std::ranges::fill(stack.lights[0].values, 0.f);
  for (int i = 0; i < size * size; ++i)
    if (stack.alpha.values[i] > 0) std::fill_n(stack.lights[0].values.begin() + 3 * i, 3, 0.5f);
  writeFileAtomically(folder_ / "constant.view", codec::encodeView(stack, {.tolerance = 0}).file);
  views_.clear();
  views_.emplace_back(folder_ / "constant.view");
  for (float y = 0; y < size; y += 0.37f)
    for (float x = 0; x < size; x += 0.37f)
      EXPECT_NEAR(shaded(x, y, {{0, {1, 1, 1}}}).r, 0.5f, 1.2e-7f) << x << ", " << y;
}

TEST_F(ShadingQueueTest, LostOperationHandsItsWeightToTheOthers) {
  const weights::LightRows rows = rowsOf({{7, {1, 1, 1}}});
  const auto radiance = [&](float lostWeight) {
    return executed({{{0, 0, 36, 36, 0.2f, 0, 1}, {0, 1, 1, 1, lostWeight, 0, 1}, {0, 2, 36, 36, 0.3f, 0, 1}},
                     rows,
                     1})[0];
  };
  EXPECT_NEAR(radiance(0.5f).g, 2 * radiance(0).g, 2e-7f);
}

TEST_F(ShadingQueueTest, TargetThatSeesBackgroundOnlyGetsWhatIsStoredNearest) {
  const std::vector<std::pair<uint32_t, Rgb>> lit = {{7, {1, 1, 1}}};
  int left = 0; // left edge of the stored blocks in the middle row
  while (!views_[0].find({left, 4})) ++left;
  const float edge = static_cast<float>(left * codec::blockSize) + 0.5f;
  EXPECT_EQ(shaded(-1, 36.5f, lit), shaded(edge, 36.5f, lit));
  EXPECT_EQ(shaded(edge - 2, 36.25f, lit), shaded(edge, 36.25f, lit));

  codec::ReflectanceStack nothing = glossySphere(size, 1);
  std::ranges::fill(nothing.alpha.values, 0.f);
  writeFileAtomically(folder_ / "empty.view", codec::encodeView(nothing, {}).file);
  views_.clear();
  views_.emplace_back(folder_ / "empty.view");
  EXPECT_EQ(shaded(36, 36, {{0, {1, 1, 1}}}), Rgb{});
}

TEST_F(ShadingQueueTest, EmptyQueueLeavesTargetsBlack) {
  EXPECT_EQ(executed({{}, {}, 3}), std::vector<Rgb>(3));
}

TEST_F(ShadingQueueTest, DamagedBlockIsNamed) {
  std::string file = readFile(folder_ / "1.view");
  file[file.size() - 1] ^= 1;
  const std::filesystem::path path = folder_ / "damaged.view";
  writeFileAtomically(path, file);
  views_.clear();
  views_.emplace_back(path);
  const codec::BlockPosition last = views_[0].position(static_cast<uint32_t>(views_[0].blockCount() - 1));
  try {
    shaded(static_cast<float>(8 * last.x + 4), static_cast<float>(8 * last.y + 4), {{0, {1, 1, 1}}});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.file(), path.string());
    EXPECT_EQ(error.field(),
              "block (" + std::to_string(last.x) + ", " + std::to_string(last.y) + ").checksum");
  }
}

} // namespace
} // namespace surflect::shading
