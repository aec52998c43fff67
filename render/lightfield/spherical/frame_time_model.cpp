#include "render/lightfield/spherical/frame_time_model.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace surflect::spherical {

namespace {

constexpr Eigen::Index kRates = 3; // gpu, main, disk

constexpr double kMemory = 0.95; // weight of a frame, relative to that of the next one
// Weights of the start values, and of neighbouring setups' being equal, relative to all frames. A setup that
// is measured hardly feels them; one that was measured once, by a frame that something delayed, is soon
// forgotten.
constexpr double kRatePull = 1e-6, kSetupPull = 1e-6, kSmooth = 1e-3;

// Least squares A x = b without negative x: unknowns that would be negative are 0.
Eigen::VectorXd solvedNonNegative(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < b.size(); ++i) free.push_back(i);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  while (!free.empty()) {
    const Eigen::VectorXd solved = Eigen::MatrixXd(a(free, free)).ldlt().solve(Eigen::VectorXd(b(free)));
    x.setZero();
    std::vector<Eigen::Index> kept;
    for (size_t i = 0; i < free.size(); ++i) {
      x[free[i]] = std::max(0.0, solved[static_cast<Eigen::Index>(i)]);
      if (solved[static_cast<Eigen::Index>(i)] >= 0) kept.push_back(free[i]);
    }
    if (kept.size() == free.size()) break;
    free = std::move(kept);
  }
  return x;
}

} // namespace

FrameTimeModel::FrameTimeModel(size_t levels, const FrameTimes& start)
    : setups_(2 * static_cast<Eigen::Index>(levels) - 1) {
  const Eigen::Index unknowns = kRates + (kMostCoarser + 1) * setups_;
  start_ = Eigen::VectorXd::Constant(unknowns, start.setup);
  start_.head<kRates>() << start.gpu, start.main, start.disk;
  assert((start_.array() > 0).all());
  fitted_ = Eigen::VectorXd::Ones(unknowns);
  squares_ = Eigen::MatrixXd::Zero(unknowns, unknowns);
  products_ = Eigen::VectorXd::Zero(unknowns);
}

// Setups of level n are at 2 n, of the blend of n and n + 1 at 2 n + 1; those of coarser mip levels follow.
Eigen::Index FrameTimeModel::setupOf(const Detail& detail) const {
  const double coarse = std::floor(detail.level);
  return kRates + detail.coarser * setups_ + 2 * static_cast<Eigen::Index>(coarse) +
         (detail.level > coarse ? 1 : 0);
}

Eigen::VectorXd FrameTimeModel::rowOf(const FrameCounts& counts, const Detail& detail) const {
  Eigen::VectorXd row = Eigen::VectorXd::Zero(start_.size());
  row.head<kRates>() << static_cast<double>(counts.triangles), static_cast<double>(counts.uploads),
      static_cast<double>(counts.reads);
  row[setupOf(detail)] = 1;
  return row.cwiseProduct(start_);
}

double FrameTimeModel::predict(const FrameCounts& counts, const Detail& detail) const {
  return rowOf(counts, detail).dot(fitted_);
}

void FrameTimeModel::add(const FrameCounts& counts, const Detail& detail, double seconds) {
  assert(seconds > 0);
  const Eigen::VectorXd row = rowOf(counts, detail) / seconds; // target 1: relative errors
  squares_ = kMemory * squares_ + row * row.transpose();
  products_ = kMemory * products_ + row;
  fit();
}

void FrameTimeModel::fit() {
  const Eigen::Index unknowns = start_.size();
  const double frames = std::max(1e-12, squares_.diagonal().tail(unknowns - kRates).sum());
  Eigen::VectorXd pull = Eigen::VectorXd::Constant(unknowns, kSetupPull * frames);
  pull.head<kRates>().setConstant(kRatePull);
  Eigen::MatrixXd a = squares_;
  a.diagonal() += pull;
  const Eigen::VectorXd b = products_ + pull; // start values are 1
  const double smooth = kSmooth * frames;
  const auto pullTogether = [&](Eigen::Index i, Eigen::Index k) {
    a(i, i) += smooth, a(k, k) += smooth;
    a(i, k) -= smooth, a(k, i) -= smooth;
  };
  for (Eigen::Index i = kRates; i < unknowns; ++i) {
    if ((i - kRates) % setups_ > 0) pullTogether(i, i - 1);
    if (i - kRates >= setups_) pullTogether(i, i - setups_);
  }
  fitted_ = solvedNonNegative(a, b);
}

FrameTimes FrameTimeModel::times(const Detail& detail) const {
  const Eigen::VectorXd seconds = fitted_.cwiseProduct(start_);
  return {seconds[0], seconds[1], seconds[2], seconds[setupOf(detail)]};
}

} // namespace surflect::spherical
