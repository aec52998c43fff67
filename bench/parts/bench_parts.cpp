// Times two parts of the program after checking their results: encoding of 128 blocks under 60 lights, and
// splatting of 532,935 surfels at 1024 x 768, ordered along a space-filling curve and shuffled.
#include "bench/doll/doll_blocks.h"
#include "bench/doll/doll_model.h"
#include "bench/doll/doll_shot.h"
#include "render/evaluation/measure.h"
#include "render/splat/reference.h"
#include "srf/codec/block.h"
#include "srf/codec/block_encoder.h"
#include "surfel/base/error.h"
#include "surfel/math/sphere_sampling.h"
#include "warp/deform.h"

#include <Eigen/Eigenvalues>
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

namespace surflect::bench {
namespace {

constexpr size_t kLights = 60, kBlocks = 128;

// Registers a benchmark that processes `items` items.
void add(const std::string& name, size_t items, const std::function<void()>& work) {
  benchmark::RegisterBenchmark(name.c_str(),
                               [=](benchmark::State& state) {
                                 for (auto _ : state) work();
                                 state.SetItemsProcessed(static_cast<int64_t>(items) * state.iterations());
                               })
      ->Unit(benchmark::kMillisecond)
      ->MeasureProcessCPUTime()
      ->UseRealTime();
}

std::vector<Eigen::MatrixXf> dollPatches() {
  std::vector<capture::Light> lights;
  for (const Vec3<double>& towards : fibonacciSphere(kLights))
    lights.push_back(
        {"", "",
         capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards), {1, 1, 1}}});
  std::vector<Eigen::MatrixXf> patches;
  for (const Vec3<double>& normal : fibonacciSphere(kBlocks))
    patches.push_back(dollPatch(normal, lights, patches.size()));
  return patches;
}

codec::EncodedBlock encoded(const Eigen::MatrixXf& x) {
  return codec::encodeBlock(~uint64_t{0}, x, DollBlocks::kTolerance, DollBlocks::kWhite);
}

// Squared singular values, ascending, by an eigendecomposition in double precision.
Eigen::VectorXd squaredSingularValues(const Eigen::MatrixXf& x) {
  Eigen::MatrixXd tall = x.cast<double>();
  if (tall.rows() < tall.cols()) tall.transposeInPlace();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(tall.transpose() * tall).eigenvalues();
}

// Checks that blocks err little more than the best approximations of their rank.
void check(const std::vector<Eigen::MatrixXf>& patches) {
  double lost = 0, least = 0; // sums of squares
  for (const Eigen::MatrixXf& x : patches) {
    const codec::EncodedBlock block = encoded(x);
    const Eigen::VectorXd squares = squaredSingularValues(x);
    lost += block.squaredError;
    least += squares.head(squares.size() - block.rank).sum();
  }
  if (const double ratio = std::sqrt(lost / least); !(ratio < 1.5))
    throw Error(fmt::format("blocks err {:.2f} times as much as the best of their rank, expected 1.5 at most",
                            ratio));
}

// Encodes blocks of 8x8 texels on one thread, compared with an eigendecomposition of the same numbers.
void registerPacking() {
  const auto patches = std::make_shared<const std::vector<Eigen::MatrixXf>>(dollPatches());
  check(*patches);
  const auto forAll = [&](const char* name, auto encode) {
    add(name, kBlocks, [=] {
      for (const Eigen::MatrixXf& x : *patches) benchmark::DoNotOptimize(encode(x));
    });
  };
  forAll("packing/encode", [](const Eigen::MatrixXf& x) { return encoded(x).squaredError; });
  forAll("packing/eigenvalues", [](const Eigen::MatrixXf& x) { return squaredSingularValues(x)[0]; });
}

// A doll to be drawn, with the memory that is reused between pictures.
struct Drawing {
  SurfelCloud rest;
  DeformedCloud deformed;
  capture::Camera<ObjectSpace> camera;
  std::vector<float> colors; // RGB of each surfel
  splat::SplatRaster coverage;
  image::Image image;

  explicit Drawing(SurfelCloud cloud) : rest(std::move(cloud)), camera(frontCamera(rest, 1024, 768)) {
    deformed = warp::deform(rest, *warp::chainWarp({}));
    colors = dollColors(rest);
  }
  void draw() {
    coverage = splat::rasterize(camera, splat::splatsOf(rest, deformed), {}, {}, std::move(coverage));
    std::vector<float> visible;
    visible.reserve(3 * coverage.visible.size());
    for (const uint32_t i : coverage.visible)
      visible.insert(visible.end(), colors.begin() + 3 * i, colors.begin() + 3 * i + 3);
    image = splat::blend(coverage, visible, 3, {}, std::move(image));
  }
  image::Image reference() const {
    return splat::blend(splat::referenceRaster(camera, splat::splatsOf(rest, deformed)), colors, 3);
  }
};

// Checks a picture against the reference. Rounding may place a fragment at the end of a layer on its other
// side, which flips that pixel; other pixels differ by the rounding of sums.
void check(const Drawing& drawing) {
  constexpr double kLeastDb = 115, kMostFlipped = 2e-5, kFlipped = 1e-3;
  const image::Image reference = drawing.reference();
  double squared = 0, flipped = 0;
  for (size_t i = 0; i < reference.values.size(); i += 3) {
    double worst = 0, sum = 0;
    for (const size_t k : {i, i + 1, i + 2}) {
      const double difference = std::abs(drawing.image.values[k] - reference.values[k]);
      worst = std::max(worst, difference);
      sum += difference * difference;
    }
    flipped += worst < kFlipped ? 0 : 1;
    squared += worst < kFlipped ? sum : 0;
  }
  const auto values = static_cast<double>(reference.values.size());
  if (const double db = evaluation::psnr(squared / values);
      !(db >= kLeastDb && 3 * flipped / values <= kMostFlipped))
    throw Error(fmt::format("splats are {:.1f} dB from the reference, {:.2g} of the pixels flipped", db,
                            3 * flipped / values));
}

// Rasterizes the doll's splats and blends three values each, on one thread, on two, and by the reference.
void registerSplats() {
  const SurfelCloud cloud = dollCloud(DollSize().surfels);
  for (const auto& [order, ordered] : {std::pair{"along the curve", cloud}, {"shuffled", shuffled(cloud)}}) {
    const auto drawing = std::make_shared<Drawing>(ordered);
    drawing->draw();
    check(*drawing);
    for (const int threads : {1, 2})
      add(fmt::format("splats {}/{} threads", order, threads), cloud.size(), [=] {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                        static_cast<size_t>(threads));
        drawing->draw();
      });
    add(fmt::format("splats {}/reference", order), cloud.size(), [=] { drawing->reference(); });
  }
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  try {
    surflect::bench::registerPacking();
    surflect::bench::registerSplats();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_parts: %s\n", error.what());
    return 1;
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
