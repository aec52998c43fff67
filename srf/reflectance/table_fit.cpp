#include "srf/reflectance/table_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

namespace surflect::reflectance {

namespace {

// Red, green, blue, and a fourth number without meaning: four make one vector register.
using Channels = Eigen::Array4f;
using NodeValues = Eigen::Array4Xf; // one column a node
using Corners = std::array<Channels, 16>;

constexpr size_t kParts = 8; // of the cells, each summed apart
constexpr size_t kNodesAtOnce = size_t{1} << 12;
constexpr uint32_t kDirectNodes = 256; // of grids that are solved by a dense factorization

Channels channelsOf(const Rgb& x) { return {x.r, x.g, x.b, 0}; }
Rgb rgbOf(const Channels& x) { return {x[0], x[1], x[2]}; }

// A photograph in its cell.
struct CellSample {
  std::array<float, 4> fraction;
  Channels leverage, right; // w a^2, w a y
};

// Photographs cell by cell, so that those of a cell share its corners in registers.
class Cells {
public:
  Cells(const TableGrid& grid, const FitSamples& samples) {
    const size_t count = samples.places.size();
    std::vector<std::pair<uint32_t, uint32_t>> order; // cell and photograph
    for (uint32_t i = 0; i < count; ++i)
      order.emplace_back(samples.places[i].half * grid.differences() + samples.places[i].difference, i);
    std::ranges::sort(order);
    for (const auto& [cell, i] : order) {
      const TablePlace& place = samples.places[i];
      if (cells_.empty() || cells_.back().cell != cell)
        cells_.push_back({cell, static_cast<uint32_t>(samples_.size()), cornersOf(grid, place).index});
      const Channels factor = channelsOf(samples.factors[i]), weighted = samples.weights[i] * factor;
      samples_.push_back({place.fraction, weighted * factor, weighted * channelsOf(samples.measured[i])});
    }
  }

  size_t size() const { return cells_.size(); }
  const std::array<uint32_t, 16>& corners(size_t cell) const { return cells_[cell].corners; }
  std::span<const CellSample> samples(size_t cell) const {
    const size_t end = cell + 1 < cells_.size() ? cells_[cell + 1].begin : samples_.size();
    return std::span(samples_).subspan(cells_[cell].begin, end - cells_[cell].begin);
  }

private:
  struct Cell {
    uint32_t cell, begin; // begin: first photograph
    std::array<uint32_t, 16> corners;
  };
  std::vector<Cell> cells_;
  std::vector<CellSample> samples_;
};

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
      : grid_(grid), options_(options), unit_(static_cast<float>(1.0 / options.white / options.white)),
        cells_(grid, samples), parts_(kParts) {
    assert(samples.measured.size() == samples.places.size());
    assert(samples.factors.size() == samples.places.size());
    assert(samples.weights.size() == samples.places.size());
  }

  // b = sum w a y c, with the weights c of the corners.
  NodeValues right() {
    return summed([&](size_t cell, Corners& sums) {
      for (const CellSample& sample : cells_.samples(cell)) {
        const std::array<float, 16> weight = cornerWeights(sample.fraction);
        for (size_t c = 0; c < weight.size(); ++c) sums[c] += weight[c] * sample.right;
      }
    });
  }

  // Diagonal of M, but for second differences that meet one node twice at the mirror line.
  NodeValues diagonal() {
    NodeValues sums = summed([&](size_t cell, Corners& own) {
      for (const CellSample& sample : cells_.samples(cell)) {
        const std::array<float, 16> weight = cornerWeights(sample.fraction);
        for (size_t c = 0; c < weight.size(); ++c) own[c] += weight[c] * weight[c] * sample.leverage;
      }
    });
    forEachSecondDifference(grid_, options_, [&](uint32_t a, uint32_t b, uint32_t c, double lambda) {
      const float share = unit_ * static_cast<float>(lambda);
      sums.col(a) += share;
      sums.col(b) += 4 * share;
      sums.col(c) += share;
    });
    return sums + unit_ * static_cast<float>(options_.ridge);
  }

  // M x
  NodeValues product(const NodeValues& x) {
    NodeValues sums = summed([&](size_t cell, Corners& own) {
      Corners values;
      for (size_t c = 0; c < values.size(); ++c) values[c] = x.col(cells_.corners(cell)[c]);
      for (const CellSample& sample : cells_.samples(cell)) {
        const std::array<float, 16> weight = cornerWeights(sample.fraction);
        Channels value = Channels::Zero();
        for (size_t c = 0; c < weight.size(); ++c) value += weight[c] * values[c];
        value *= sample.leverage;
        for (size_t c = 0; c < weight.size(); ++c) own[c] += weight[c] * value;
      }
    });
    forEachSecondDifference(grid_, options_, [&](uint32_t a, uint32_t b, uint32_t c, double lambda) {
      const Channels bend = unit_ * static_cast<float>(lambda) * (x.col(a) - 2 * x.col(b) + x.col(c));
      sums.col(a) += bend;
      sums.col(b) -= 2 * bend;
      sums.col(c) += bend;
    });
    return sums + unit_ * static_cast<float>(options_.ridge) * x;
  }

  // M of one channel.
  Eigen::MatrixXd matrix(Eigen::Index channel) const {
    const auto n = static_cast<Eigen::Index>(grid_.size());
    Eigen::MatrixXd sums = unit_ * options_.ridge * Eigen::MatrixXd::Identity(n, n);
    for (size_t cell = 0; cell < cells_.size(); ++cell) {
      Eigen::Matrix<double, 16, 16> own = Eigen::Matrix<double, 16, 16>::Zero();
      for (const CellSample& sample : cells_.samples(cell)) {
        const std::array<float, 16> weight = cornerWeights(sample.fraction);
        const auto column =
            Eigen::Map<const Eigen::Matrix<float, 16, 1>>(weight.data()).cast<double>().eval();
        own += sample.leverage[channel] * column * column.transpose();
      }
      for (size_t i = 0; i < 16; ++i)
        for (size_t j = 0; j < 16; ++j)
          sums(cells_.corners(cell)[i], cells_.corners(cell)[j]) +=
              own(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
    forEachSecondDifference(grid_, options_, [&](uint32_t a, uint32_t b, uint32_t c, double lambda) {
      const std::array<std::pair<uint32_t, double>, 3> row{{{a, 1.}, {b, -2.}, {c, 1.}}};
      for (const auto& [i, x] : row)
        for (const auto& [j, y] : row) sums(i, j) += unit_ * lambda * x * y;
    });
    return sums;
  }

private:
  // Sum over all cells of what add(cell, sums) adds to the cell's corners.
  template <class Add> NodeValues summed(const Add& add) {
    const size_t count = cells_.size();
    tbb::parallel_for(size_t{0}, kParts, [&](size_t p) {
      parts_[p].setZero(4, grid_.size());
      for (size_t cell = p * count / kParts; cell < (p + 1) * count / kParts; ++cell) {
        Corners own;
        own.fill(Channels::Zero());
        add(cell, own);
        for (size_t c = 0; c < own.size(); ++c) parts_[p].col(cells_.corners(cell)[c]) += own[c];
      }
    });
    NodeValues sums(4, grid_.size());
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
  const FitOptions& options_;
  const float unit_; // 1 / white^2
  const Cells cells_;
  std::vector<NodeValues> parts_;
};

// Scalar products of the channels, in double precision.
Eigen::Array4d dot(const NodeValues& a, const NodeValues& b) {
  return (a.cast<double>() * b.cast<double>()).rowwise().sum();
}

// a / b, or 0 where b is 0.
Channels ratio(const Eigen::Array4d& a, const Eigen::Array4d& b) {
  return (b > 0).select(a / b, 0).cast<float>();
}

NodeValues valuesOf(std::span<const Rgb> nodes) {
  NodeValues values(4, nodes.size());
  for (size_t node = 0; node < nodes.size(); ++node)
    values.col(static_cast<Eigen::Index>(node)) = channelsOf(nodes[node]);
  return values;
}

std::vector<Rgb> rgbOf(const NodeValues& values) {
  std::vector<Rgb> nodes;
  for (Eigen::Index node = 0; node < values.cols(); ++node)
    nodes.push_back(rgbOf(Channels(values.col(node))));
  return nodes;
}

std::vector<Rgb> solvedDirectly(const NormalEquations& equations, const NodeValues& right) {
  NodeValues x = NodeValues::Zero(4, right.cols());
  for (Eigen::Index channel = 0; channel < 3; ++channel) {
    const Eigen::VectorXd b = right.row(channel).transpose().matrix().cast<double>();
    x.row(channel) = equations.matrix(channel).ldlt().solve(b).transpose().array().cast<float>();
  }
  return rgbOf(x);
}

} // namespace

std::vector<Rgb> fitTable(const TableGrid& grid, const FitSamples& samples, const FitOptions& options,
                          std::span<const Rgb> start, const Progress& progress) {
  assert(start.empty() || start.size() == grid.size());
  progress.checkpoint();
  NormalEquations equations(grid, samples, options);
  const NodeValues right = equations.right();
  if (grid.size() <= kDirectNodes) return solvedDirectly(equations, right);
  const NodeValues diagonal = equations.diagonal();
  NodeValues x = start.empty() ? NodeValues::Zero(4, grid.size()) : valuesOf(start);
  NodeValues r = start.empty() ? right : right - equations.product(x);
  NodeValues z = r / diagonal, p = z;
  const Eigen::Array4d enough = options.tolerance * options.tolerance * dot(right, right / diagonal);
  Eigen::Array4d rz = dot(r, z);
  for (size_t step = 0; step < options.mostIterations && (rz > enough).any(); ++step) {
    progress.checkpoint();
    const NodeValues mp = equations.product(p);
    const Channels alpha = ratio(rz, dot(p, mp));
    x += p.colwise() * alpha;
    r -= mp.colwise() * alpha;
    z = r / diagonal;
    const Eigen::Array4d next = dot(r, z);
    p = z + p.colwise() * ratio(next, rz);
    rz = next;
  }
  return rgbOf(x);
}

std::vector<Rgb> fitTableReference(const TableGrid& grid, const FitSamples& samples,
                                   const FitOptions& options) {
  const auto n = static_cast<Eigen::Index>(grid.size());
  const double unit = 1.0 / options.white / options.white;
  NodeValues nodes = NodeValues::Zero(4, n);
  for (Eigen::Index channel = 0; channel < 3; ++channel) {
    Eigen::MatrixXd matrix = unit * options.ridge * Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    for (size_t i = 0; i < samples.places.size(); ++i) {
      const double weight = samples.weights[i], factor = double{channelsOf(samples.factors[i])[channel]};
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
    nodes.row(channel) = matrix.ldlt().solve(right).transpose().array().cast<float>();
  }
  return rgbOf(nodes);
}

} // namespace surflect::reflectance
