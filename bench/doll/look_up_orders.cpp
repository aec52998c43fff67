#include "bench/doll/look_up_orders.h"

#include "srf/codec/look_up_kernel.h"
#include "srf/codec/view_taps.h"
#include "warp/deform.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cassert>
#include <functional>
#include <random>

namespace surflect::bench {

namespace {

constexpr size_t kShuffled = 20'000, kStretches = 10, kOfStretch = 20'000; // operations

// Of a view's blocks in memory, in the mean.
size_t imageBytes(const model::Model& model) {
  constexpr size_t kEvery = 97;
  size_t blocks = 0, sampled = 0, bytes = 0;
  for (const codec::ViewFile& view : model.files)
    for (size_t block = 0; block < view.blockCount(); ++block)
      if (blocks++ % kEvery == 0) {
        bytes += view.read(static_cast<uint32_t>(block)).memory();
        ++sampled;
      }
  assert(sampled > 0);
  return bytes * blocks / sampled / model.files.size();
}

Rgb lookUpOne(const codec::ShadingOp& op, const codec::LightRows& rows, codec::BlockCache& cache,
              codec::LookUpKernel kernel) {
  Rgb sum;
  const codec::ViewFile& view = cache.views()[op.view];
  const auto find = [&](codec::BlockPosition position) { return view.find(position); };
  codec::ViewTaps<std::optional<uint32_t>> all;
  codec::findTaps(codec::TexelPlace::at(view.header(), op.x, op.y), find, all);
  for (const auto& [block, taps] : all) {
    const auto held = cache.get(op.view, *block);
    float rgb[4] = {};
    const codec::LookUpJob job = codec::jobOf(held->terms(), taps, rgb);
    kernel(rows.lights.data() + op.rowBegin, op.rowEnd - op.rowBegin, rows.weights.data(), &job, 1);
    sum = sum + op.weight * Rgb{rgb[0], rgb[1], rgb[2]};
  }
  return sum;
}

// Operations are those of the first target, then of the second, and so on. Those of a surfel stay together.
std::vector<codec::ShadingOp> shuffled(std::span<const codec::ShadingOp> ops, size_t targets) {
  std::vector<size_t> first(targets + 1);
  for (const codec::ShadingOp& op : ops) ++first[op.target + 1];
  for (size_t i = 0; i < targets; ++i) first[i + 1] += first[i];
  std::vector<size_t> order(targets);
  for (size_t i = 0; i < targets; ++i) order[i] = i;
  std::ranges::shuffle(order, std::mt19937(1));
  std::vector<codec::ShadingOp> result;
  for (const size_t target : order)
    if (result.size() < kShuffled)
      result.insert(result.end(), ops.begin() + static_cast<std::ptrdiff_t>(first[target]),
                    ops.begin() + static_cast<std::ptrdiff_t>(first[target + 1]));
  return result;
}

std::vector<codec::ShadingOp> stretches(std::span<const codec::ShadingOp> ops) {
  if (ops.size() <= kStretches * kOfStretch) return {ops.begin(), ops.end()};
  std::vector<codec::ShadingOp> result;
  for (size_t i = 0; i < kStretches; ++i) {
    const auto stretch = ops.subspan(i * (ops.size() / kStretches), kOfStretch);
    result.insert(result.end(), stretch.begin(), stretch.end());
  }
  return result;
}

// The operations of some targets, which count from 0 then.
void executeFrom(std::span<const codec::ShadingOp> ops, const codec::LightRows& rows, uint32_t begin,
                 uint32_t end, codec::BlockCache& cache, codec::ShadingStats& stats) {
  const auto part = std::ranges::subrange(std::ranges::lower_bound(ops, begin, {}, &codec::ShadingOp::target),
                                          std::ranges::lower_bound(ops, end, {}, &codec::ShadingOp::target));
  std::vector<codec::ShadingOp> own(part.begin(), part.end());
  for (codec::ShadingOp& op : own) op.target -= begin;
  codec::execute(own, rows, end - begin, cache, stats);
}

} // namespace

std::vector<OrderCost> costOfOrders(const model::Model& model, const Shot& shot,
                                    std::span<const size_t> images) {
  const DeformedCloud deformed = warp::deform(model.cloud, *shot.warp);
  const splat::SplatRaster coverage = surfels::look(shot.camera, model.cloud, deformed, shot.options.splats);
  const model::QueryBatch batch =
      surfels::queriesAt(model.cloud, deformed, coverage.visible, shot.camera, shot.lights);
  const model::ShadingPlan plan = model::planShading(model, batch, shot.options.shade);
  const auto targets = static_cast<uint32_t>(batch.size());
  const codec::LookUpKernel kernel = codec::lookUpKernel(bestSimd());

  const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
  const size_t image = imageBytes(model);
  std::vector<OrderCost> costs;
  const auto measure = [&](const char* order, size_t held, size_t operations,
                           const std::function<void(codec::BlockCache&)>& work) {
    codec::BlockCache cache(model.files, held * image);
    forgetFiles(model);
    const Lap lap = lapOf([&] { work(cache); });
    const auto count = static_cast<double>(operations);
    costs.push_back(
        {order, held, operations, lap.seconds / count, static_cast<double>(cache.counts().reads) / count});
  };
  const auto oneByOne = [&](const char* order, size_t held, std::span<const codec::ShadingOp> ops) {
    measure(order, held, ops.size(), [&](codec::BlockCache& cache) {
      float sum = 0;
      for (const codec::ShadingOp& op : ops) sum += lookUpOne(op, plan.rows, cache, kernel).g;
      [[maybe_unused]] volatile float kept = sum;
    });
  };
  const std::vector<codec::ShadingOp> anywhere = shuffled(plan.ops, targets), along = stretches(plan.ops);
  for (const size_t held : images) {
    oneByOne("shuffled, one by one", held, anywhere);
    oneByOne("along the curve, one by one", held, along);
    measure("sorted, as frames are", held, plan.ops.size(), [&](codec::BlockCache& cache) {
      codec::ShadingStats stats;
      for (uint32_t begin = 0; begin < targets; begin += model::kTargetsAtOnce)
        executeFrom(plan.ops, plan.rows, begin, std::min<uint32_t>(targets, begin + model::kTargetsAtOnce),
                    cache, stats);
    });
    measure("sorted, all at once", held, plan.ops.size(), [&](codec::BlockCache& cache) {
      codec::ShadingStats stats;
      executeFrom(plan.ops, plan.rows, 0, targets, cache, stats);
    });
  }
  return costs;
}

} // namespace surflect::bench
