#include "bench/packing/packing_times.h"

#include "bench/doll/doll_blocks.h"
#include "bench/doll/spiral.h"
#include "srf/codec/block.h"
#include "srf/codec/block_encoder.h"
#include "surfel/base/error.h"

#include <Eigen/SVD>
#include <fmt/format.h>

#include <cmath>
#include <vector>

namespace surflect::bench {

namespace {

constexpr size_t kLights = 60, kBlocks = 128;

codec::EncodedBlock encoded(const Eigen::MatrixXf& x) {
  return codec::encodeBlock(~uint64_t{0}, x, DollBlocks::kTolerance, DollBlocks::kWhite);
}

Eigen::BDCSVD<Eigen::MatrixXf> decomposed(const Eigen::MatrixXf& x) {
  return Eigen::BDCSVD<Eigen::MatrixXf>(x, Eigen::ComputeThinU | Eigen::ComputeThinV);
}

std::vector<Eigen::MatrixXf> blocksOfDoll() {
  std::vector<capture::Light> lights;
  for (const Vec3<double>& towards : spiral(kLights)) {
    capture::Light& light = lights.emplace_back();
    light.kind = capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards), {1, 1, 1}};
  }
  std::vector<Eigen::MatrixXf> blocks;
  for (const Vec3<double>& normal : spiral(kBlocks))
    blocks.push_back(dollPatch(normal, lights, blocks.size()));
  return blocks;
}

} // namespace

PackingTimes timePacking(int rounds) {
  const std::vector<Eigen::MatrixXf> blocks = blocksOfDoll();
  PackingTimes times;
  times.blocks = blocks.size();
  const auto count = static_cast<double>(blocks.size());
  double held = 0, lost = 0, least = 0; // sums of squares
  for (const Eigen::MatrixXf& x : blocks) {
    const codec::EncodedBlock block = encoded(x);
    const Eigen::BDCSVD<Eigen::MatrixXf> svd = decomposed(x);
    const auto left = svd.singularValues().tail(svd.singularValues().size() - block.rank);
    held += x.cast<double>().squaredNorm();
    lost += block.squaredError;
    least += left.cast<double>().squaredNorm();
    times.rank += block.rank / count;
    times.bytes += static_cast<double>(block.record.size()) / count;
    const auto texels = static_cast<double>(x.rows()), lights = static_cast<double>(x.cols());
    times.operations += 2 * texels * lights * ((lights + 1) / 2 + 2 * block.rank) / count;
  }
  times.error = std::sqrt(lost / held);
  times.overBest = std::sqrt(lost / least);
  if (!(times.overBest < 1.5))
    throw Error(fmt::format("blocks err {:.2f} times as much as the best of their rank", times.overBest));

  std::vector<Lap> ours, svd;
  double kept = 0;
  for (int round = 0; round < rounds; ++round) {
    ours.push_back(lapOf([&] {
      for (const Eigen::MatrixXf& x : blocks) kept += encoded(x).squaredError;
    }));
    svd.push_back(lapOf([&] {
      for (const Eigen::MatrixXf& x : blocks) kept += double{decomposed(x).singularValues()[0]};
    }));
  }
  [[maybe_unused]] volatile double used = kept;
  times.ours = timesOf(ours);
  times.svd = timesOf(svd);
  return times;
}

} // namespace surflect::bench
