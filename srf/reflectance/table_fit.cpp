#include "srf/reflectance/table_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <tbb/parallel_for.h>

#include <array>
#include <cassert>

namespace surflect::reflectance {

namespace {

using Channels = Eigen::Array3d;
using NodeValues = Eigen::Array3Xd; // one column a node

constexpr size_t kParts = 16; // of the photographs, each summed apart
constexpr size_t kNodesAtOnce = size_t{1} << 12;

Channels channelsOf(const Rgb& x) { return {x.r, x.g, x.b}; }
Rgb rgbOf(const Channels& x) {
  return {static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2])};
}

// Calls visit(before, node, after, lambda) for every second difference T_before - 2 T_node + T_after.
template <class Visit>
void forEachSecondDifference(const TableGrid& grid, const FitOptions& options, const Visit& visit) {
  const auto [nu, nv, nk, nl] = grid.nodes;
  const auto along = [&](uint32_t place, uint32_t nodes, double lambda, const auto& indexAt) {
    if (place > 0 && place + 1 < nodes) visit(indexAt(-1), indexAt(0), indexAt(1), lambda);
  };
  const uint32_t middle = nu * nv / 2; // nodes before it are mirror images
  for (uint32_t half = middle; half < nu * nv; ++half)
    for (uint32_t difference = 0; difference < nk * nl; ++difference) {
      const auto stepHalf = [&](uint32_t stride) {
        return [&grid, half, difference, stride](int step) {
          return grid.indexOf(half + static_cast<uint32_t>(step) * stride, difference);
        };
      };
      const auto stepDifference = [&](uint32_t stride) {
        return [&grid, half, difference, stride](int step) {
          return grid.indexOf(half, difference + static_cast<uint32_t>(step) * stride);
        };
      };
      along(half / nv, nu, options.smoothHalf, stepHalf(nv));
      along(half % nv, nv, options.smoothHalf, stepHalf(1));
      along(difference / nl, nk, options.smoothDifference, stepDifference(nl));
      along(difference % nl, nl, options.smoothDifference, stepDifference(1));
    }
}

// M x = b of the least squares, channel by channel.
class NormalEquations {
public:
  NormalEquations(const TableGrid& grid, const FitSamples& samples, const FitOptions& options)
      : grid_(grid), samples_(samples), options_(options), unit_(1.0 / options.white / options.white),
        parts_(kParts) {
    assert(samples.measured.size() == samples.places.size());
    assert(samples.factors.size() == samples.places.size());
    assert(samples.weights.size() == samples.places.size());
  }

  // b = sum w a y c, with the weights c of the corners.
  NodeValues right() {
    return summed([&](size_t i, const TableCorners& corners, NodeValues& sums) {
      const Channels share = samples_.weights[i] * channelsOf(samples_.factors[i] * samples_.measured[i]);
      for (size_t c = 0; c < corners.index.size(); ++c)
        sums.col(corners.index[c]) += corners.weight[c] * share;
    });
  }

  // Diagonal of M, but for second differences that meet one node twice at the mirror line.
  NodeValues diagonal() {
    NodeValues sums = summed([&](size_t i, const TableCorners& corners, NodeValues& part) {
      const Channels share = leverage(i);
      for (size_t c = 0; c < corners.index.size(); ++c)
        part.col(corners.index[c]) += double{corners.weight[c]} * corners.weight[c] * share;
    });
    forEachSecondDifference(grid_, options_, [&](uint32_t a, uint32_t b, uint32_t c, double lambda) {
      sums.col(a) += unit_ * lambda;
      sums.col(b) += 4 * unit_ * lambda;
      sums.col(c) += unit_ * lambda;
    });
    return sums + unit_ * options_.ridge;
  }

  // M x
  NodeValues product(const NodeValues& x) {
    NodeValues sums = summed([&](size_t i, const TableCorners& corners, NodeValues& part) {
      Channels value = Channels::Zero();
      for (size_t c = 0; c < corners.index.size(); ++c) value += corners.weight[c] * x.col(corners.index[c]);
      value *= leverage(i);
      for (size_t c = 0; c < corners.index.size(); ++c)
        part.col(corners.index[c]) += corners.weight[c] * value;
    });
    forEachSecondDifference(grid_, options_, [&](uint32_t a, uint32_t b, uint32_t c, double lambda) {
      const Channels bend = unit_ * lambda * (x.col(a) - 2 * x.col(b) + x.col(c));
      sums.col(a) += bend;
      sums.col(b) -= 2 * bend;
      sums.col(c) += bend;
    });
    return sums + unit_ * options_.ridge * x;
  }

private:
  // w a^2
  Channels leverage(size_t i) const {
    return samples_.weights[i] * channelsOf(samples_.factors[i] * samples_.factors[i]);
  }

  // Sum over all photographs of what add(i, corners, sums) adds.
  template <class Add> NodeValues summed(const Add& add) {
    const size_t count = samples_.places.size();
    tbb::parallel_for(size_t{0}, kParts, [&](size_t p) {
      parts_[p].setZero(3, grid_.size());
      for (size_t i = p * count / kParts; i < (p + 1) * count / kParts; ++i)
        add(i, cornersOf(grid_, samples_.places[i]), parts_[p]);
    });
    NodeValues sums(3, grid_.size());
    tbb::parallel_for(size_t{0}, (grid_.size() + kNodesAtOnce - 1) / kNodesAtOnce, [&](size_t tile) {
      const auto begin = static_cast<Eigen::Index>(tile * kNodesAtOnce);
      const Eigen::Index length = std::min(static_cast<Eigen::Index>(kNodesAtOnce), sums.cols() - begin);
      sums.middleCols(begin, length) = parts_[0].middleCols(begin, length);
      for (size_t p = 1; p < kParts; ++p)
        sums.middleCols(begin, length) += parts_[p].middleCols(begin, length);
    });
    return sums;
  }

  const TableGrid& grid_;
  const FitSamples& samples_;
  const FitOptions& options_;
  const double unit_; // 1 / white^2
  std::vector<NodeValues> parts_;
};

Channels dot(const NodeValues& a, const NodeValues& b) { return (a * b).rowwise().sum(); }

// a / b, or 0 where b is 0.
Channels ratio(const Channels& a, const Channels& b) { return (b > 0).select(a / b, 0); }

std::vector<Rgb> rgbOf(const NodeValues& values) {
  std::vector<Rgb> nodes;
  for (Eigen::Index node = 0; node < values.cols(); ++node)
    nodes.push_back(rgbOf(Channels(values.col(node))));
  return nodes;
}

} // namespace

std::vector<Rgb> fitTable(const TableGrid& grid, const FitSamples& samples, const FitOptions& options,
                          const Progress& progress) {
  NormalEquations equations(grid, samples, options);
  const NodeValues diagonal = equations.diagonal();
  NodeValues x = NodeValues::Zero(3, grid.size()), r = equations.right(), z = r / diagonal, p = z;
  const Channels enough = options.tolerance * options.tolerance * dot(r, z);
  Channels rz = dot(r, z);
  for (size_t step = 0; step < options.mostIterations && (rz > enough).any(); ++step) {
    progress.checkpoint();
    const NodeValues mp = equations.product(p);
    const Channels alpha = ratio(rz, dot(p, mp));
    x += p.colwise() * alpha;
    r -= mp.colwise() * alpha;
    z = r / diagonal;
    const Channels next = dot(r, z);
    p = z + p.colwise() * ratio(next, rz);
    rz = next;
  }
  return rgbOf(x);
}

std::vector<Rgb> fitTableReference(const TableGrid& grid, const FitSamples& samples,
                                   const FitOptions& options) {
  const auto n = static_cast<Eigen::Index>(grid.size());
  const double unit = 1.0 / options.white / options.white;
  NodeValues nodes(3, n);
  for (Eigen::Index channel = 0; channel < 3; ++channel) {
    Eigen::MatrixXd matrix = unit * options.ridge * Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    for (size_t i = 0; i < samples.places.size(); ++i) {
      const double weight = samples.weights[i], factor = channelsOf(samples.factors[i])[channel];
      const TableCorners corners = cornersOf(grid, samples.places[i]);
      Eigen::VectorXd row = Eigen::VectorXd::Zero(n);
      for (size_t c = 0; c < corners.index.size(); ++c) row[corners.index[c]] += factor * corners.weight[c];
      matrix += weight * row * row.transpose();
      right += weight * channelsOf(samples.measured[i])[channel] * row;
    }
    forEachSecondDifference(grid, options, [&](uint32_t a, uint32_t b, uint32_t c, double lambda) {
      Eigen::VectorXd row = Eigen::VectorXd::Zero(n);
      row[a] += 1;
      row[b] -= 2;
      row[c] += 1;
      matrix += unit * lambda * row * row.transpose();
    });
    nodes.row(channel) = matrix.ldlt().solve(right).transpose().array();
  }
  return rgbOf(nodes);
}

} // namespace surflect::reflectance
