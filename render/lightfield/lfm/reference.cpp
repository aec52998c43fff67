#include "render/lightfield/lfm/reference.h"

#include "render/lightfield/common/ray_radiance.h"
#include "render/lightfield/lfm/radiance.h"
#include "render/lightfield/lfm/tile.h"

#include <Eigen/Core>
#include <tbb/parallel_for.h>

#include <cmath>
#include <random>
#include <utility>

namespace surflect::lfm {

Reference::Reference(LightFieldMaps maps, const Progress& progress)
    : maps_(decoded(std::move(maps))), edges_(edgeCorrections(maps_)), rays_(maps_.mesh, progress) {}

image::Image Reference::render(const capture::Camera<AcquisitionSpace>& camera, std::optional<size_t> terms,
                               const Progress& progress) const {
  const capture::Lens& lens = camera.lens;
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  image::Image picture(lens.width, lens.height, 4);
  tbb::parallel_for(0, lens.height, [&](int y) {
    progress.checkpoint();
    for (int x = 0; x < lens.width; ++x) {
      const auto ray = capture::rayThrough(lens, {x + 0.5, y + 0.5});
      if (!ray) continue;
      const Direction direction = normalized(worldFromCamera(ray->direction));
      const auto hit = lightfield::firstFrontHit(maps_.mesh, rays_, worldFromCamera(ray->origin), direction);
      if (!hit) continue;
      const Vec3<double> radiance = radianceAt(maps_, {hit->triangle, hit->b, hit->c}, -direction,
                                               terms.value_or(maps_.terms.size()), edges_);
      for (size_t channel = 0; channel < 3; ++channel)
        picture.at(x, y)[channel] = static_cast<float>(radiance[static_cast<Eigen::Index>(channel)]);
      picture.at(x, y)[3] = 1;
    }
  });
  return picture;
}

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostIterations = 10000;

// Strictly positive.
MatrixXd randomMatrix(Eigen::Index rows, Eigen::Index columns, std::mt19937_64& random) {
  return MatrixXd::NullaryExpr(rows, columns,
                               [&] { return static_cast<double>((random() >> 11) + 1) * 0x1p-53; });
}

MatrixXd quotient(const MatrixXd& a, const MatrixXd& b) {
  return a.binaryExpr(
      b, [](double numerator, double denominator) { return denominator > 0 ? numerator / denominator : 0; });
}

} // namespace

ReferenceFactors referencePca(const MatrixXd& f, int terms, double convergence) {
  ReferenceFactors factors{MatrixXd::Zero(f.rows(), terms), MatrixXd::Zero(f.cols(), terms)};
  std::mt19937_64 random(1);
  for (int p = 0; p < terms; ++p) {
    const MatrixXd fp = f - factors.u * factors.v.transpose();
    const auto timesAp = [&](const VectorXd& v) -> VectorXd { return fp.transpose() * (fp * v); };
    VectorXd v = randomMatrix(f.cols(), 1, random).normalized();
    for (int i = 0; i < kMostIterations; ++i) {
      const VectorXd next = timesAp(v);
      if (next.isZero(0)) break;
      const double change = (next.normalized() - v).norm();
      v = next.normalized();
      if (change < convergence) break;
    }
    // The appendix takes the root of a vector; its length is meant, which makes lambda the singular value.
    const double lambda = std::sqrt(timesAp(v).norm());
    if (!(lambda > 0)) continue;
    const VectorXd u = fp * v / lambda;
    const double maxU = u.cwiseAbs().maxCoeff(), maxV = v.cwiseAbs().maxCoeff();
    const double alpha = std::sqrt(maxU * lambda / maxV);
    factors.u.col(p) = lambda * u / alpha;
    factors.v.col(p) = alpha * v;
  }
  return factors;
}

ReferenceFactors referenceNmf(const MatrixXd& f, int terms, int iterations, uint64_t seed) {
  std::mt19937_64 random(seed);
  MatrixXd u = randomMatrix(f.rows(), terms, random), v = randomMatrix(f.cols(), terms, random);
  for (int i = 0; i < iterations; ++i) {
    const MatrixXd un = quotient(f * v, u * (v.transpose() * v));
    const MatrixXd vn = quotient(f.transpose() * u, v * (u.transpose() * u));
    u = u.cwiseProduct(un);
    v = v.cwiseProduct(vn);
    for (int k = 0; k < terms; ++k)
      if (const double sum = u.col(k).sum(); sum > 0) u.col(k) /= sum;
  }
  return {u, v};
}

} // namespace surflect::lfm
