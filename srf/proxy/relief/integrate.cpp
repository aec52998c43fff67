#include "srf/proxy/relief/integrate.h"

#include "srf/proxy/relief/frontal_plane.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::relief {

namespace {

using Values = std::vector<double>;

// The Laplacian of a weighted grid graph: (A f)_i = sum_j w_ij (f_i - f_j).
struct Grid {
  int width, height;
  Values right, down; // weights of edges
  Values diagonal;    // sum of a node's weights

  Grid(int w, int h, Values toRight, Values toDown)
      : width(w), height(h), right(std::move(toRight)), down(std::move(toDown)),
        diagonal(static_cast<size_t>(w) * static_cast<size_t>(h), 0) {
    for (size_t i = 0; i < diagonal.size(); ++i) {
      if (right[i] > 0) diagonal[i] += right[i], diagonal[i + 1] += right[i];
      if (down[i] > 0) diagonal[i] += down[i], diagonal[i + stride()] += down[i];
    }
  }
  size_t stride() const { return static_cast<size_t>(width); }

  // sum_j w_ij f_j
  double neighbors(const Values& f, size_t i, int x, int y) const {
    double sum = 0;
    if (x > 0) sum += right[i - 1] * f[i - 1];
    if (x + 1 < width) sum += right[i] * f[i + 1];
    if (y > 0) sum += down[i - stride()] * f[i - stride()];
    if (y + 1 < height) sum += down[i] * f[i + stride()];
    return sum;
  }

  template <class Work> void forNodes(const Work& work) const {
    size_t i = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x, ++i)
        if (diagonal[i] > 0) work(i, x, y);
  }
  template <class Work> void forNodesBackwards(const Work& work) const {
    size_t i = diagonal.size();
    for (int y = height - 1; y >= 0; --y)
      for (int x = width - 1; x >= 0; --x)
        if (diagonal[--i] > 0) work(i, x, y);
  }
};

// Coarse grid with one node per 2x2. Constant interpolation makes the coarse problem too stiff, by 2 in the
// plane; 1.8 works best [Braess 1995, §3].
Grid coarsened(const Grid& fine) {
  constexpr double kStiffness = 1.8;
  const int width = (fine.width + 1) / 2, height = (fine.height + 1) / 2;
  Values right(static_cast<size_t>(width) * static_cast<size_t>(height), 0), down = right;
  fine.forNodes([&](size_t i, int x, int y) {
    const size_t coarse =
        static_cast<size_t>(y / 2) * static_cast<size_t>(width) + static_cast<size_t>(x / 2);
    if (x % 2 == 1) right[coarse] += fine.right[i] / kStiffness;
    if (y % 2 == 1) down[coarse] += fine.down[i] / kStiffness;
  });
  return {width, height, std::move(right), std::move(down)};
}

// Symmetric approximation of the Laplacian's inverse: one V-cycle.
class Multigrid {
public:
  explicit Multigrid(Grid finest) {
    grids_.push_back(std::move(finest));
    while (grids_.back().width > 1 || grids_.back().height > 1) grids_.push_back(coarsened(grids_.back()));
  }
  const Grid& finest() const { return grids_[0]; }

  Values solve(const Values& b) const { return cycle(0, b); }

private:
  Values cycle(size_t level, const Values& b) const {
    const Grid& grid = grids_[level];
    Values f(b.size(), 0);
    if (level + 1 == grids_.size()) return f;
    constexpr int kSweeps = 2;
    const auto relax = [&](size_t i, int x, int y) {
      f[i] = (b[i] + grid.neighbors(f, i, x, y)) / grid.diagonal[i];
    };
    for (int sweep = 0; sweep < kSweeps; ++sweep) grid.forNodes(relax);
    const Grid& coarse = grids_[level + 1];
    Values residual(coarse.diagonal.size(), 0);
    const auto parent = [&](int x, int y) {
      return static_cast<size_t>(y / 2) * coarse.stride() + static_cast<size_t>(x / 2);
    };
    grid.forNodes([&](size_t i, int x, int y) {
      residual[parent(x, y)] += b[i] - grid.diagonal[i] * f[i] + grid.neighbors(f, i, x, y);
    });
    const Values correction = cycle(level + 1, residual);
    grid.forNodes([&](size_t i, int x, int y) { f[i] += correction[parent(x, y)]; });
    for (int sweep = 0; sweep < kSweeps; ++sweep) grid.forNodesBackwards(relax);
    return f;
  }

  std::vector<Grid> grids_;
};

double dot(const Values& a, const Values& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// Preconditioned conjugate gradients.
Values conjugateGradients(const Multigrid& preconditioner, const Values& b, const Progress& progress) {
  constexpr int kMostRounds = 500;
  constexpr double kTolerance = 1e-9;
  const Grid& a = preconditioner.finest();
  Values f(b.size(), 0), r = b, z = preconditioner.solve(r), p = z, ap(b.size(), 0);
  double rz = dot(r, z);
  const double first = std::sqrt(dot(r, r));
  for (int round = 0; round < kMostRounds && rz > 0; ++round) {
    progress.checkpoint();
    a.forNodes([&](size_t i, int x, int y) { ap[i] = a.diagonal[i] * p[i] - a.neighbors(p, i, x, y); });
    const double pap = dot(p, ap);
    if (!(pap > 0)) break;
    const double step = rz / pap;
    for (size_t i = 0; i < f.size(); ++i) f[i] += step * p[i], r[i] -= step * ap[i];
    if (std::sqrt(dot(r, r)) <= kTolerance * first) break;
    z = preconditioner.solve(r);
    const double next = dot(r, z), beta = next / rz;
    rz = next;
    for (size_t i = 0; i < p.size(); ++i) p[i] = z[i] + beta * p[i];
  }
  return f;
}

// Subtracts the mean of each connected piece.
void centerPieces(const Grid& grid, Values& f) {
  std::vector<uint8_t> reached(f.size(), 0);
  std::vector<size_t> piece;
  for (size_t seed = 0; seed < f.size(); ++seed) {
    if (reached[seed] || !(grid.diagonal[seed] > 0)) continue;
    piece.assign(1, seed);
    reached[seed] = 1;
    double sum = 0;
    const auto reach = [&](double weight, size_t i) {
      if (weight > 0 && !reached[i]) {
        reached[i] = 1;
        piece.push_back(i);
      }
    };
    for (size_t next = 0; next < piece.size(); ++next) {
      const size_t i = piece[next], x = i % grid.stride();
      sum += f[i];
      if (x > 0) reach(grid.right[i - 1], i - 1);
      reach(grid.right[i], i + 1);
      if (i >= grid.stride()) reach(grid.down[i - grid.stride()], i - grid.stride());
      reach(grid.down[i], i + grid.stride());
    }
    const double mean = sum / static_cast<double>(piece.size());
    for (const size_t i : piece) f[i] -= mean;
  }
}

} // namespace

Differences::Differences(const image::Mask& where)
    : mask(where), right(where.inside.size(), 0), down(right), rightWeight(right), downWeight(right) {
  size_t i = 0;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x, ++i) {
      if (!mask.inside[i]) continue;
      rightWeight[i] = x + 1 < mask.width && mask.inside[i + 1];
      downWeight[i] = y + 1 < mask.height && mask.inside[i + static_cast<size_t>(mask.width)];
    }
}

std::vector<double> potentialOf(const Differences& d, const Progress& progress) {
  const size_t stride = static_cast<size_t>(d.mask.width);
  const Multigrid multigrid(Grid(d.mask.width, d.mask.height, d.rightWeight, d.downWeight));
  Values divergence(d.mask.inside.size(), 0);
  for (size_t i = 0; i < divergence.size(); ++i) {
    const auto flow = [&](double amount, size_t to) {
      divergence[i] -= amount;
      divergence[to] += amount;
    };
    if (d.rightWeight[i] > 0) flow(d.rightWeight[i] * d.right[i], i + 1);
    if (d.downWeight[i] > 0) flow(d.downWeight[i] * d.down[i], i + stride);
  }
  Values f = conjugateGradients(multigrid, divergence, progress);
  centerPieces(multigrid.finest(), f);
  return f;
}

namespace {

constexpr double kUnknown = 1e-4; // weight of an unknown difference
constexpr double kGrazing = 0.1;  // smallest cosine between normal and viewer

Vec3<double> towardsViewer(const capture::Lens& lens, const Vec2<double>& q) {
  return lens.model == capture::Lens::Model::orthographic ? Vec3<double>(0, 0, 1)
                                                          : Vec3<double>(-q[0], -q[1], 1).normalized();
}

// Weight of a normal. Its error enters gradients as 1 / cosine^2; weights are inverse variances, with a
// minimum for unknown normals.
double trust(const Vec3<double>& n, const Vec3<double>& viewer) {
  if (n.isZero()) return kUnknown;
  const double cosine = std::max(kGrazing, n.normalized().dot(viewer));
  return cosine * cosine;
}

} // namespace

Vec2<double> depthGradient(const capture::Lens& lens, const Vec2<double>& q, const Vec3<double>& normal) {
  if (normal.isZero()) return Vec2<double>::Zero();
  const Vec3<double> viewer = towardsViewer(lens, q);
  Vec3<double> n = normal.normalized();
  if (const double cosine = n.dot(viewer); cosine < kGrazing) n += (kGrazing - cosine) * viewer;
  const double unit = lens.model == capture::Lens::Model::orthographic ? 1 : std::sqrt(1 + q.squaredNorm());
  return Vec2<double>(n[0], n[1]) / (unit * n.dot(viewer));
}

DepthMap integrateNormals(const capture::Camera<AcquisitionSpace>& camera, const image::Image& normals,
                          const image::Mask& wanted, const Progress& progress) {
  assert(normals.channels == 3 && normals.width == wanted.width && normals.height == wanted.height);
  progress("relief", 0);
  const size_t width = static_cast<size_t>(wanted.width), pixels = wanted.inside.size();
  const std::vector<Vec2<double>> zeros(pixels, Vec2<double>::Zero());
  DepthMap map{wanted, std::vector<double>(pixels, 0), zeros};
  std::vector<Vec2<double>> points = zeros;
  std::vector<double> weight(pixels, 0);
  for (size_t i = 0; i < pixels; ++i) {
    if (!map.mask.inside[i]) continue;
    const auto q =
        imagePoint(camera.lens, {static_cast<double>(i % width) + 0.5, static_cast<double>(i / width) + 0.5});
    map.mask.inside[i] = q.has_value();
    if (!q) continue;
    points[i] = *q;
    const Vec3<double> n = camera.cameraFromWorld.rotation() *
                           Eigen::Map<const Vec3<float>>(&normals.values[3 * i]).cast<double>();
    map.gradient[i] = depthGradient(camera.lens, points[i], n);
    weight[i] = trust(n, towardsViewer(camera.lens, points[i]));
  }

  // Trapezoidal rule: exact if depth (or its logarithm) is quadratic. Unknown neighbours are ignored.
  const auto isKnown = [&](size_t i) { return weight[i] > kUnknown; };
  Differences differences(map.mask);
  const auto set = [&](double& difference, double& edge, size_t i, size_t j) {
    if (edge == 0) return;
    const Vec2<double> sum = map.gradient[i] + map.gradient[j];
    difference = sum.dot(points[j] - points[i]) / (isKnown(i) == isKnown(j) ? 2 : 1);
    edge = std::min(weight[i], weight[j]);
  };
  for (size_t i = 0; i < pixels; ++i) {
    set(differences.right[i], differences.rightWeight[i], i, i + 1);
    set(differences.down[i], differences.downWeight[i], i, i + width);
  }
  const auto potential = potentialOf(differences, progress);
  const double middle = frontalDepth(camera);
  for (size_t i = 0; i < potential.size(); ++i)
    if (map.mask.inside[i])
      map.depth[i] = camera.lens.model == capture::Lens::Model::orthographic
                         ? middle + potential[i]
                         : middle * std::exp(potential[i]);
  progress("relief", 1);
  return map;
}

} // namespace surflect::relief
