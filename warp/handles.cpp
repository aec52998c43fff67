#include "warp/handles.h"

#include "surfel/base/error.h"

#include <Eigen/Dense>

#include <cassert>
#include <string>

namespace surflect::warp {

namespace {

// phi(d), and phi'(d) / d, which is finite at 0.
struct Kernel {
  std::optional<double> radius;

  double value(double d) const {
    if (!radius) return d * d * d;
    const double q = d / *radius, p = std::max(0.0, 1 - q);
    return p * p * p * p * (4 * q + 1);
  }
  double slopeOverDistance(double d) const {
    if (!radius) return 3 * d;
    const double p = std::max(0.0, 1 - d / *radius);
    return -20 * p * p * p / (*radius * *radius);
  }
};

// Lengths are scaled by `scale` about `center`, so that the equations are well conditioned.
struct Arrangement {
  std::vector<Vec3<double>> rest; // scaled
  Kernel kernel;                  // scaled
  Vec3<double> center;
  double scale = 1;

  Vec3<double> scaled(const Vec3<double>& x) const { return (x - center) / scale; }
};

Arrangement arranged(std::vector<Vec3<double>> rest, std::optional<double> radius) {
  Arrangement handles;
  Vec3<double> least = rest[0], most = rest[0];
  for (const Vec3<double>& r : rest) {
    least = least.cwiseMin(r);
    most = most.cwiseMax(r);
  }
  handles.center = (least + most) / 2;
  if (const double size = (most - least).norm() / 2; size > 0) handles.scale = size;
  for (Vec3<double>& r : rest) r = handles.scaled(r);
  handles.rest = std::move(rest);
  if (radius) handles.kernel.radius = *radius / handles.scale;
  return handles;
}

// Minimum scaled distance; below, d^3 is lost among the other entries of the equations.
constexpr double leastDistance = 1e-4;

void checkApart(const std::vector<Vec3<double>>& points) {
  for (size_t i = 0; i < points.size(); ++i)
    for (size_t j = 0; j < i; ++j)
      if ((points[i] - points[j]).norm() < leastDistance)
        throw Error::mismatch("handles apart from each other by 1/10000 of their extent",
                              "handles " + std::to_string(j) + " and " + std::to_string(i) + " nearer");
}

// Orthonormal directions in which the points differ: 0 to 3 columns.
Eigen::Matrix3Xd spanOf(const std::vector<Vec3<double>>& points) {
  Vec3<double> center = Vec3<double>::Zero();
  for (const Vec3<double>& point : points) center += point / static_cast<double>(points.size());
  Mat3<double> spread = Mat3<double>::Zero();
  for (const Vec3<double>& point : points) spread += (point - center) * (point - center).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3<double>> solver(spread); // squares, ascending
  int rank = 0;
  while (rank < 3 && solver.eigenvalues()[2 - rank] > 1e-12 * solver.eigenvalues()[2]) ++rank;
  return solver.eigenvectors().rightCols(rank);
}

// Displacement  sum of w_i phi(|x - r_i|) + a + A x,  in scaled units.
struct Displacement {
  std::vector<Vec3<double>> weights;
  Vec3<double> constant = Vec3<double>::Zero();
  Mat3<double> linear = Mat3<double>::Zero();
};

class Pulled final : public Warp {
public:
  Pulled(const Arrangement& handles, Displacement displacement)
      : handles_(handles), displacement_(std::move(displacement)) {}

  Vec3<double> position(const Vec3<double>& x) const override {
    const Vec3<double> y = handles_.scaled(x);
    Vec3<double> moved = displacement_.constant + displacement_.linear * y;
    for (size_t i = 0; i < handles_.rest.size(); ++i)
      moved += handles_.kernel.value((y - handles_.rest[i]).norm()) * displacement_.weights[i];
    return x + handles_.scale * moved;
  }

  // J = I + A + sum of phi'(d_i) / d_i  w_i (x - r_i)^T
  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override {
    const Vec3<double> y = handles_.scaled(x);
    Mat3<double> sum = Mat3<double>::Identity() + displacement_.linear;
    for (size_t i = 0; i < handles_.rest.size(); ++i) {
      const Vec3<double> offset = y - handles_.rest[i];
      sum += handles_.kernel.slopeOverDistance(offset.norm()) * displacement_.weights[i] * offset.transpose();
    }
    return sum;
  }

private:
  Arrangement handles_;
  Displacement displacement_;
};

} // namespace

struct Handles::System {
  Arrangement handles;
  Eigen::Matrix3Xd span; // linear part; the constant comes before it
  bool hasAffine = false;
  Eigen::PartialPivLU<Eigen::MatrixXd> equations;
};

// With K_ij = phi(|r_i - r_j|) and P_i = (1, r_i . span), of the displacements D:
//   ( K   P ) ( w )   ( D )
//   ( P^T 0 ) ( c ) = ( 0 )
Handles::Handles(std::vector<Vec3<double>> rest, std::optional<double> radius) {
  assert(!radius || *radius > 0);
  if (rest.empty() || rest.size() > mostHandles)
    throw Error::mismatch("1 to " + std::to_string(mostHandles), std::to_string(rest.size()));
  const size_t n = rest.size();
  auto system = std::make_shared<System>();
  system->handles = arranged(std::move(rest), radius);
  checkApart(system->handles.rest);
  system->hasAffine = !radius;
  if (system->hasAffine) system->span = spanOf(system->handles.rest);

  const std::vector<Vec3<double>>& r = system->handles.rest;
  const Eigen::Index affine = system->hasAffine ? 1 + system->span.cols() : 0;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + affine, n + affine);
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < n; ++j) matrix(i, j) = system->handles.kernel.value((r[i] - r[j]).norm());
    if (!system->hasAffine) continue;
    matrix(i, n) = 1;
    matrix.block(i, n + 1, 1, affine - 1) = r[i].transpose() * system->span;
  }
  matrix.bottomLeftCorner(affine, n) = matrix.topRightCorner(n, affine).transpose();
  system->equations.compute(matrix);
  system_ = std::move(system);
}

size_t Handles::size() const { return system_->handles.rest.size(); }

WarpPointer Handles::pullTo(std::span<const Vec3<double>> targets) const {
  const System& s = *system_;
  const size_t n = size();
  assert(targets.size() == n);
  Eigen::MatrixX3d displacements = Eigen::MatrixX3d::Zero(s.equations.rows(), 3);
  for (size_t i = 0; i < n; ++i) displacements.row(i) = s.handles.scaled(targets[i]) - s.handles.rest[i];
  const Eigen::MatrixX3d solution = s.equations.solve(displacements);

  Displacement displacement;
  for (size_t i = 0; i < n; ++i) displacement.weights.push_back(solution.row(i));
  if (s.hasAffine) {
    displacement.constant = solution.row(n);
    displacement.linear = (s.span * solution.bottomRows(s.span.cols())).transpose();
  }
  return std::make_unique<Pulled>(s.handles, std::move(displacement));
}

} // namespace surflect::warp
