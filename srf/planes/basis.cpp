#include "srf/planes/basis.h"

#include <Eigen/Eigenvalues>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <array>

namespace surflect::planes {

Eigen::MatrixXf encodedSamples(const Samples& samples, float white) {
  return (samples.linear / white).unaryExpr([](float value) { return encoded(value); });
}

Moments momentsOf(const Eigen::MatrixXf& encoded) {
  constexpr Eigen::Index kPart = 4096; // in float, then summed in double
  const Eigen::Index rows = encoded.rows(), columns = std::max<Eigen::Index>(encoded.cols(), 1);
  Moments moments{Eigen::VectorXd::Zero(rows), Eigen::MatrixXd::Zero(rows, rows)};
  moments.mean = encoded.cast<double>().rowwise().sum() / static_cast<double>(columns);
  const Eigen::VectorXf mean = moments.mean.cast<float>();
  for (Eigen::Index begin = 0; begin < encoded.cols(); begin += kPart) {
    const Eigen::MatrixXf part =
        encoded.middleCols(begin, std::min(kPart, encoded.cols() - begin)).colwise() - mean;
    moments.covariance += (part * part.transpose()).cast<double>();
  }
  moments.covariance /= static_cast<double>(columns);
  return moments;
}

Basis principalBasis(const Moments& moments, Eigen::Index planes) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(moments.covariance);
  const Eigen::Index count = std::min(planes, moments.covariance.rows());
  Basis basis{moments.mean.cast<float>(), {}};
  basis.vectors = solver.eigenvectors().rightCols(count).rowwise().reverse().cast<float>();
  for (auto column : basis.vectors.colwise()) {
    Eigen::Index largest = 0;
    column.cwiseAbs().maxCoeff(&largest);
    if (column[largest] < 0) column *= -1;
  }
  return basis;
}

Planes projected(const Stack& stack, const Basis& basis, float white, const Progress& progress) {
  Planes planes{stack.width(), stack.height(), {}};
  const auto count = static_cast<size_t>(basis.planes()), width = static_cast<size_t>(planes.width);
  const Eigen::VectorXf atMean = basis.vectors.transpose() * basis.mean;
  for (size_t k = 0; k < count; ++k)
    planes.values.emplace_back(planes.pixels(), -atMean[static_cast<Eigen::Index>(k)]);
  for (size_t p = 0; p < stack.size(); ++p) {
    progress("planes", static_cast<double>(p) / static_cast<double>(stack.size()));
    const image::Image photograph = readPhotograph(stack, p);
    tbb::parallel_for(size_t{0}, static_cast<size_t>(planes.height), [&](size_t y) {
      std::array<std::vector<float>, 3> channels;
      const float* const row = photograph.values.data() + 3 * y * width;
      for (size_t c = 0; c < 3; ++c) {
        channels[c].resize(width);
        for (size_t x = 0; x < width; ++x) channels[c][x] = encoded(row[3 * x + c] / white);
      }
      for (size_t k = 0; k < count; ++k) {
        const auto part =
            basis.vectors.col(static_cast<Eigen::Index>(k)).segment<3>(static_cast<Eigen::Index>(3 * p));
        const float r = part[0], g = part[1], b = part[2];
        float* const plane = planes.values[k].data() + y * width;
        for (size_t x = 0; x < width; ++x)
          plane[x] += r * channels[0][x] + g * channels[1][x] + b * channels[2][x];
      }
    });
  }
  return planes;
}

Planes halved(const Planes& planes) {
  Planes half{(planes.width + 1) / 2, (planes.height + 1) / 2, {}};
  half.values.assign(planes.values.size(), std::vector<float>(half.pixels()));
  const auto width = static_cast<size_t>(planes.width), height = static_cast<size_t>(planes.height);
  tbb::parallel_for(size_t{0}, static_cast<size_t>(half.height), [&](size_t y) {
    const size_t top = 2 * y, below = std::min(top + 1, height - 1);
    for (size_t k = 0; k < planes.values.size(); ++k) {
      const std::vector<float>& from = planes.values[k];
      float* const to = half.values[k].data() + y * static_cast<size_t>(half.width);
      for (size_t x = 0; x < static_cast<size_t>(half.width); ++x) {
        const size_t left = 2 * x, right = std::min(left + 1, width - 1);
        to[x] = (from[top * width + left] + from[top * width + right] + from[below * width + left] +
                 from[below * width + right]) /
                4;
      }
    }
  });
  return half;
}

} // namespace surflect::planes
