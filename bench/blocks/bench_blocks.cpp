// bench_blocks: microseconds to compress a block of 8x8 texels under 60 lights on one thread, beside Eigen's
// singular value decomposition alone of the same numbers, in turns, after checking that a block that comes
// back keeps its bound and is nearly as good as the best of its rank.
#include "bench/doll/doll_blocks.h"
#include "bench/doll/spiral.h"
#include "srf/store/block.h"
#include "srf/store/block_encoder.h"

#include <Eigen/SVD>
#include <fmt/core.h>

#include <cstdio>
#include <ctime>

namespace surflect {
namespace {

constexpr size_t kLights = 60, kBlocks = 128;
constexpr int kRounds = 5;
constexpr uint64_t kAllTexels = ~uint64_t{0};

double processorMicroseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

// A block, its best approximation of each rank, and how large each program's error is. Sums of squares.
struct Errors {
  double energy = 0, ours = 0, best = 0;
  int rank = 0;
  size_t bytes = 0;
};

Errors errorsOf(const Eigen::MatrixXf& x) {
  const EncodedBlock encoded = encodeBlock(kAllTexels, x, DollBlocks::kTolerance, DollBlocks::kWhite);
  const Eigen::BDCSVD<Eigen::MatrixXf> svd(x, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const auto left = svd.singularValues().tail(svd.singularValues().size() - encoded.rank);
  return {x.cast<double>().squaredNorm(), encoded.squaredError, left.cast<double>().squaredNorm(),
          encoded.rank, encoded.record.size()};
}

int run() {
  std::vector<Light> lights;
  for (const Vec3<double>& towards : spiral(kLights)) {
    Light& light = lights.emplace_back();
    light.kind = DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards), {1, 1, 1}};
  }
  std::vector<Eigen::MatrixXf> blocks;
  for (const Vec3<double>& normal : spiral(kBlocks))
    blocks.push_back(dollPatch(normal, lights, blocks.size()));

  Errors sum;
  for (const Eigen::MatrixXf& x : blocks) {
    const Errors errors = errorsOf(x);
    sum.energy += errors.energy, sum.ours += errors.ours, sum.best += errors.best, sum.rank += errors.rank;
    sum.bytes += errors.bytes;
  }
  const double lost = std::sqrt(sum.ours / sum.best);
  if (!(lost < 1.5)) {
    std::fprintf(stderr, "bench_blocks: blocks err %g times as much as the best of their rank\n", lost);
    return 1;
  }

  std::vector<double> ours, svd;
  for (int round = 0; round < kRounds; ++round) {
    double kept = 0;
    const auto timed = [&](const auto& work) {
      const double start = processorMicroseconds();
      for (const Eigen::MatrixXf& x : blocks) kept += work(x);
      return (processorMicroseconds() - start) / static_cast<double>(blocks.size());
    };
    ours.push_back(timed([](const auto& x) {
      return encodeBlock(kAllTexels, x, DollBlocks::kTolerance, DollBlocks::kWhite).squaredError;
    }));
    svd.push_back(timed([](const auto& x) {
      return double{
          Eigen::BDCSVD<Eigen::MatrixXf>(x, Eigen::ComputeThinU | Eigen::ComputeThinV).singularValues()[0]};
    }));
    if (!(kept > 0)) return 1;
  }
  std::ranges::sort(ours);
  std::ranges::sort(svd);
  const double mine = ours[kRounds / 2], theirs = svd[kRounds / 2];
  fmt::print("{} blocks of rank {:.1f}, {:.0f} bytes; error {:.4f} of what they hold, {:.2f} times the best "
             "of their rank\n",
             kBlocks, static_cast<double>(sum.rank) / kBlocks, static_cast<double>(sum.bytes) / kBlocks,
             std::sqrt(sum.ours / sum.energy), lost);
  fmt::print(
      "compressed in {:.0f} us each, {:.0f} a second; decomposed by BDCSVD in {:.0f} us, {:.2f} times that\n",
      mine, 1e6 / mine, theirs, theirs / mine);
  return 0;
}

} // namespace
} // namespace surflect

int main() { return surflect::run(); }
