#include "render/lightfield/slf/stretch_descent.h"

#include "render/lightfield/slf/border_gaps.h"
#include "render/lightfield/slf/stretch.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>

namespace surflect::slf {

namespace {

using Mat2 = Eigen::Matrix2d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Triangles count as at least this thick, relative to their longest edge: those without area must resist
// being flattened, too.
constexpr double kLeastThickness = 1e-3;
// Parts of the border keep this distance, in sides of a square of the rectangle's area: many times what
// rounding to float moves them.
constexpr double kClearance = 2e-6;
constexpr double kWidestGap = 0.15; // the clearance is at most this share of the rectangle's shorter side
constexpr double kOverRelaxation =
    1.7;                            // steps this much longer carry changes across the disc in fewer sweeps
constexpr int kSweepsPerAspect = 4; // the aspect follows the map this often

// A triangle seen from one of its corners: edges d and e lead to the next and to the previous corner.
struct Wedge {
  uint32_t next, previous; // vertices
  double area;             // on the surface
  double dd, de, ee;       // products of the edges on the surface
};

// Integral of a + c over a triangle with its corner at p: area N / D^2, where with edges d', e' in the plane
// N = |d|^2 |e'|^2 - 2 (d . e) (d' . e') + |e|^2 |d'|^2 and D = d' x e'.
double energyOf(const Wedge& wedge, const Vec2<double>& d, const Vec2<double>& e) {
  const double det = d.x() * e.y() - d.y() * e.x();
  if (!(det > 0)) return kInfinity;
  const double n = wedge.dd * e.squaredNorm() - 2 * wedge.de * d.dot(e) + wedge.ee * d.squaredNorm();
  return wedge.area * n / (det * det);
}

// Adds the derivatives of that by p.
void addDerivatives(const Wedge& wedge, const Vec2<double>& d, const Vec2<double>& e, Vec2<double>& gradient,
                    Mat2& hessian) {
  const double det = d.x() * e.y() - d.y() * e.x();
  const double n = wedge.dd * e.squaredNorm() - 2 * wedge.de * d.dot(e) + wedge.ee * d.squaredNorm();
  const Vec2<double> byN = -2 * (wedge.dd * e - wedge.de * (d + e) + wedge.ee * d);
  const Vec2<double> byDet(d.y() - e.y(), e.x() - d.x());
  const double scale = wedge.area / (det * det);
  gradient += scale * (byN - 2 * n / det * byDet);
  const Mat2 mixed = byN * byDet.transpose();
  hessian +=
      scale * (2 * (wedge.dd - 2 * wedge.de + wedge.ee) * Mat2::Identity() -
               2 / det * (mixed + mixed.transpose()) + 6 * n / (det * det) * byDet * byDet.transpose());
}

// Step of Newton with the curvature made positive; along axes that are not free it is 0.
Vec2<double> newtonStep(const Vec2<double>& gradient, const Mat2& hessian,
                        const std::array<bool, 2>& isFree) {
  const double mean = hessian.trace() / 2;
  const double spread = std::hypot((hessian(0, 0) - hessian(1, 1)) / 2, hessian(0, 1));
  const double least = mean - spread, floor = 1e-3 * (std::abs(mean) + spread);
  const Mat2 positive = hessian + std::max(0.0, floor - least) * Mat2::Identity();
  if (isFree[0] && isFree[1]) return -positive.inverse() * gradient;
  Vec2<double> step = Vec2<double>::Zero();
  for (int axis = 0; axis < 2; ++axis)
    if (isFree[static_cast<size_t>(axis)]) step[axis] = -gradient[axis] / positive(axis, axis);
  return step;
}

class Descent {
public:
  Descent(const Disc& disc, std::vector<Vec2<double>>& coordinates, double clearance)
      : disc_(disc), p_(coordinates), clearance_(clearance), placeInBorder_(disc.vertices.size(), -1),
        first_(disc.vertices.size() + 1, 0), wedges_(3 * disc.triangles.size()) {
    for (size_t i = 0; i < disc.border.size(); ++i) placeInBorder_[disc.border[i]] = static_cast<int>(i);
    for (const auto& triangle : disc.triangles)
      for (const uint32_t v : triangle) ++first_[v + 1];
    for (size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
    std::vector<uint32_t> at(first_.begin(), first_.end() - 1);
    for (const auto& triangle : disc.triangles)
      for (size_t k = 0; k < 3; ++k) wedges_[at[triangle[k]]++] = wedgeOf(triangle, k);
  }

  void run(const DescentOptions& options, const Progress& progress) {
    double before = kInfinity;
    for (int sweep = 0; sweep < options.mostSweeps; ++sweep) {
      progress.checkpoint();
      if (sweep % kSweepsPerAspect == 0) {
        const double now = fitAspect();
        if (!(now < (1 - kSweepsPerAspect * options.leastGain) * before)) break;
        before = now;
      }
      for (uint32_t v = 0; v < p_.size(); ++v) improve(v);
    }
    for (Vec2<double>& p : p_) p = p.cwiseQuotient(sides_);
  }

private:
  Wedge wedgeOf(const std::array<uint32_t, 3>& triangle, size_t k) const {
    Wedge wedge{triangle[(k + 1) % 3], triangle[(k + 2) % 3], 0, 0, 0, 0};
    const Vec3<double>& corner = disc_.positions[triangle[k]];
    const Vec3<double> d = disc_.positions[wedge.next] - corner, e = disc_.positions[wedge.previous] - corner;
    wedge.dd = d.squaredNorm(), wedge.de = d.dot(e), wedge.ee = e.squaredNorm();
    const double longest = std::max({wedge.dd, wedge.ee, (d - e).squaredNorm()});
    const double thicker = kLeastThickness * kLeastThickness * longest;
    wedge.dd += thicker, wedge.ee += thicker, wedge.de += thicker / 2;
    wedge.area = std::sqrt(std::max(0.0, wedge.dd * wedge.ee - wedge.de * wedge.de)) / 2;
    return wedge;
  }

  // Scales the rectangle of area 1 to the aspect of least stretch. Returns the squared stretch.
  double fitAspect() {
    const StretchSums sums = stretchSums(disc_.positions, disc_.triangles, p_);
    if (!(sums.a > 0 && sums.c > 0 && std::isfinite(sums.a + sums.c))) return kInfinity;
    const double scale = std::sqrt(sums.bestAspect());
    const Vec2<double> scales(scale, 1 / scale);
    sides_ = sides_.cwiseProduct(scales);
    for (Vec2<double>& p : p_) p = p.cwiseProduct(scales);
    std::vector<Vec2<double>> polygon;
    for (const uint32_t v : disc_.border) polygon.push_back(p_[v]);
    border_.emplace(std::move(polygon));
    return sums.leastStretch();
  }

  double energyAround(uint32_t v, const Vec2<double>& p) const {
    double sum = 0;
    for (uint32_t i = first_[v]; i < first_[v + 1]; ++i)
      sum += energyOf(wedges_[i], p_[wedges_[i].next] - p, p_[wedges_[i].previous] - p);
    return sum;
  }

  // Does the border cross itself, or come too near to itself, if one of its vertices moves to p?
  bool spoilsBorder(size_t place, const Vec2<double>& p) const {
    const double clearance = std::min(clearance_, kWidestGap * sides_.minCoeff());
    return border_->wouldCross(place, p, kClearance) ||
           (clearance > 0 && border_->wouldNarrowGap(place, p, clearance));
  }

  void improve(uint32_t v) {
    const Vec2<double> p = p_[v];
    Vec2<double> gradient = Vec2<double>::Zero();
    Mat2 hessian = Mat2::Zero();
    for (uint32_t i = first_[v]; i < first_[v + 1]; ++i)
      addDerivatives(wedges_[i], p_[wedges_[i].next] - p, p_[wedges_[i].previous] - p, gradient, hessian);
    std::array<bool, 2> isFree{};
    for (int axis = 0; axis < 2; ++axis)
      isFree[static_cast<size_t>(axis)] =
          !(p[axis] <= 0 && gradient[axis] > 0) && !(p[axis] >= sides_[axis] && gradient[axis] < 0);
    Vec2<double> step = newtonStep(gradient, hessian, isFree);
    if (!step.allFinite()) return;
    const double energy = energyAround(v, p);
    step *= kOverRelaxation;
    for (int halving = 0; halving < 8; ++halving, step /= 2) {
      const Vec2<double> to = (p + step).cwiseMax(0).cwiseMin(sides_);
      if (!(energyAround(v, to) < energy)) continue;
      if (placeInBorder_[v] >= 0) {
        const auto place = static_cast<size_t>(placeInBorder_[v]);
        if (spoilsBorder(place, to)) continue;
        border_->move(place, to);
      }
      p_[v] = to;
      return;
    }
  }

  const Disc& disc_;
  std::vector<Vec2<double>>& p_;
  const double clearance_;
  std::optional<MovingBorder> border_; // Disc::border, since fitAspect()
  std::vector<int> placeInBorder_;     // #vertices; -1 inside
  std::vector<uint32_t> first_;        // #vertices + 1; of the wedges of each
  std::vector<Wedge> wedges_;
  Vec2<double> sides_ = {1, 1};
};

} // namespace

void lowerStretch(const Disc& disc, std::vector<Vec2<double>>& coordinates, const DescentOptions& options,
                  const Progress& progress) {
  Descent(disc, coordinates, options.clearance).run(options, progress);
}

} // namespace surflect::slf
