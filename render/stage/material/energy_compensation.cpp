#include "render/stage/material/energy_compensation.h"

#include <tbb/parallel_for.h>

#include <cassert>

namespace surflect::material {

namespace {

constexpr double kFlattest = 0.02; // smallest tabulated ratio of roughnesses

// Nodes and weights of Lagrange interpolation on an even grid.
struct Taps {
  int first = 0, count = 1;
  std::array<double, 4> weights{1};
};

// Quadratic interpolation at x, in nodes.
Taps quadratic(double x, int nodes) {
  const int first = std::clamp(static_cast<int>(x + 0.5) - 1, 0, nodes - 3);
  const double d = x - first;
  return {first, 3, {(d - 1) * (d - 2) / 2, -d * (d - 2), d * (d - 1) / 2}};
}
Taps cubic(double x, int nodes) {
  const int first = std::clamp(static_cast<int>(x) - 1, 0, nodes - 4);
  const double d = x - first, before = (d - 1) * d, after = (d - 2) * (d - 3);
  return {first, 4, {-(d - 1) * after / 6, d * after / 2, -before * (d - 3) / 2, before * (d - 2) / 6}};
}

double nodeAt(int i, int nodes) { return static_cast<double>(i) / (nodes - 1); }

// Cosine at a table coordinate x in 0..1, and its inverse. Nodes are denser at both ends.
double cosineAt(double x) { return x * x / (x * x + (1 - x) * (1 - x)); }
double placeOfCosine(double mu) {
  const double s = std::sqrt(mu), c = std::sqrt(std::max(0.0, 1 - mu));
  return s / (s + c);
}

// Roughness at a table coordinate x in 0..1, and its inverse. Nodes are denser at small roughnesses.
double roughnessAt(double x) { return kSmooth + (1 - kSmooth) * x * x; }
double placeOfRoughness(double alpha) {
  return std::sqrt(std::clamp((alpha - kSmooth) / (1 - kSmooth), 0.0, 1.0));
}

// Number of nodes of the table of mean losses along the larger of the two roughnesses.
constexpr int kMeanRoughnesses = 64;
double meanRoughnessAt(double x) { return std::pow(kSmooth, 1 - x); }
double placeOfMeanRoughness(double alpha) {
  static const double range = -1 / std::log(kSmooth);
  return std::clamp(1 + range * std::log(alpha), 0.0, 1.0);
}

} // namespace

double averageOverFacets(const ShadingDirection& wo, const Roughness& alpha, const FacetAlbedo& albedo) {
  constexpr int kSide = 40;
  double sum = 0;
  for (int j = 0; j < kSide; ++j) {
    // Substitution that makes both ends, the horizon of the facets and the zenith, smooth.
    const double x = (j + 0.5) / kSide, v = x * x * (3 - 2 * x), weight = 6 * x * (1 - x);
    double ring = 0;
    for (int i = 0; i < kSide; ++i)
      ring += albedo(wo, ggx::visibleNormal(wo, alpha, (i + 0.5) / kSide, v), alpha);
    sum += weight * ring;
  }
  return sum / (kSide * kSide);
}

EnergyCompensation::EnergyCompensation(const FacetAlbedo& albedo, Shape shape, Coordinate coordinate)
    : shape_(shape), coordinate_(coordinate) {
  const bool isotropic = shape == Shape::isotropic;
  directions_ = isotropic ? 48 : 16;
  azimuths_ = isotropic ? 1 : 3;
  ratios_ = isotropic ? 1 : 4;
  roughnesses_ = isotropic ? 16 : 8;
  meanRatios_ = isotropic ? 1 : 12;
  fillLosses(albedo);
  fillMeans();
}

// Direction of a node; azimuth is the squared cosine to x, in the coordinate's space.
ShadingDirection EnergyCompensation::directionAt(double x, double azimuth, const Roughness& alpha) const {
  const double t = std::max(cosineAt(x), 1e-9), r = std::sqrt(1 - t * t);
  const ShadingDirection w(r * std::sqrt(azimuth), r * std::sqrt(1 - azimuth), t);
  if (coordinate_ == Coordinate::plain) return w;
  return normalized(ShadingDirection(w.x() / alpha.x, w.y() / alpha.y, w.z()));
}

void EnergyCompensation::fillLosses(const FacetAlbedo& albedo) {
  const int slices = azimuths_ * ratios_ * roughnesses_;
  losses_.resize(static_cast<size_t>(directions_ * slices));
  tbb::parallel_for(0, slices, [&](int slice) {
    const double azimuth = azimuths_ == 1 ? 1 : nodeAt(slice % azimuths_, azimuths_);
    const double ratio = ratios_ == 1 ? 1 : std::max(kFlattest, nodeAt(slice / azimuths_ % ratios_, ratios_));
    const double rough = roughnessAt(nodeAt(slice / (azimuths_ * ratios_), roughnesses_));
    const Roughness alpha{rough, rough * ratio};
    for (int d = 0; d < directions_; ++d) {
      const ShadingDirection wo = directionAt(nodeAt(d, directions_), azimuth, alpha);
      losses_[static_cast<size_t>(slice * directions_ + d)] =
          static_cast<float>(1 - averageOverFacets(wo, alpha, albedo));
    }
  });
}

LossesAtRoughness EnergyCompensation::lossesAt(const Roughness& alpha) const {
  LossesAtRoughness at;
  at.turned_ = shape_ == Shape::anisotropic && alpha.y > alpha.x;
  const double most = at.turned_ ? alpha.y : alpha.x;
  const double ratio = shape_ == Shape::isotropic ? 1 : (at.turned_ ? alpha.x : alpha.y) / most;
  at.stretch_ = coordinate_ == Coordinate::stretched ? alpha : Roughness{1, 1};
  at.directions_ = directions_;
  at.azimuths_ = ratio < 1 ? azimuths_ : 1;

  const Taps a = cubic(placeOfRoughness(most) * (roughnesses_ - 1), roughnesses_);
  Taps r;
  if (ratio < 1)
    r = quadratic(std::max(kFlattest, ratio) * (ratios_ - 1), ratios_);
  else
    r.first = ratios_ - 1; // isotropic: equal for each azimuth
  const int nodes = directions_ * at.azimuths_;
  assert(nodes <= LossesAtRoughness::kMostNodes);
  at.rows_.fill(0);
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < r.count; ++j) {
      const int slice = ((a.first + i) * ratios_ + r.first + j) * azimuths_;
      const float* rows = &losses_[static_cast<size_t>(slice * directions_)];
      const auto weight = static_cast<float>(a.weights[i] * r.weights[j]);
      for (int k = 0; k < nodes; ++k) at.rows_[k] += weight * rows[k];
    }
  return at;
}

LossesAtRoughness EnergyCompensation::at(const Roughness& alpha) const {
  LossesAtRoughness at = lossesAt(alpha);
  at.meanLoss = meanLoss(alpha);
  return at;
}

double EnergyCompensation::loss(const ShadingDirection& w, const Roughness& alpha) const {
  return lossesAt(alpha).loss(w);
}

double LossesAtRoughness::loss(const ShadingDirection& w) const {
  const double x2 = squared(stretch_.x * w.x()), y2 = squared(stretch_.y * w.y()), z2 = squared(w.z());
  const double cosine = std::sqrt(z2 / (x2 + y2 + z2));
  const Taps d = cubic(placeOfCosine(cosine) * (directions_ - 1), directions_);
  Taps c;
  if (azimuths_ > 1) {
    const double azimuth = x2 + y2 > 0 ? (turned_ ? y2 : x2) / (x2 + y2) : 1;
    c = quadratic(azimuth * (azimuths_ - 1), azimuths_);
  }
  double sum = 0;
  for (int k = 0; k < c.count; ++k) {
    const float* row = &rows_[static_cast<size_t>((c.first + k) * directions_ + d.first)];
    const double along = d.weights[0] * double{row[0]} + d.weights[1] * double{row[1]} +
                         d.weights[2] * double{row[2]} + d.weights[3] * double{row[3]};
    sum += c.weights[k] * along;
  }
  return std::clamp(sum, 0.0, 1.0);
}

void EnergyCompensation::fillMeans() {
  logMeans_.resize(static_cast<size_t>(kMeanRoughnesses * meanRatios_));
  tbb::parallel_for(0, kMeanRoughnesses * meanRatios_, [&](int node) {
    constexpr int kCosines = 96, kAzimuths = 16;
    const double most = meanRoughnessAt(nodeAt(node / meanRatios_, kMeanRoughnesses));
    const double ratio = meanRatios_ == 1 ? 1 : std::max(kFlattest, nodeAt(node % meanRatios_, meanRatios_));
    const Roughness alpha{most, most * ratio};
    const LossesAtRoughness losses = lossesAt(alpha);
    const int azimuths = ratio < 1 ? kAzimuths : 1;
    double sum = 0;
    for (int i = 0; i < kCosines; ++i)
      for (int j = 0; j < azimuths; ++j) { // one quarter of the circle
        const ShadingDirection w = grazingDirection(alpha, (i + 0.5) / kCosines, (j + 0.5) / azimuths / 4);
        sum += losses.loss(w) * cosineDensity(w) / grazingDensity(w, alpha);
      }
    logMeans_[static_cast<size_t>(node)] = std::log(std::max(1e-12, sum / (kCosines * azimuths)));
  });
}

double EnergyCompensation::meanLoss(const Roughness& alpha) const {
  const double most = shape_ == Shape::isotropic ? alpha.x : std::max(alpha.x, alpha.y);
  const double ratio = std::max(kFlattest, std::min(alpha.x, alpha.y) / most);
  const Taps a = cubic(placeOfMeanRoughness(most) * (kMeanRoughnesses - 1), kMeanRoughnesses);
  Taps r;
  if (meanRatios_ > 1) r = cubic(ratio * (meanRatios_ - 1), meanRatios_);
  double sum = 0;
  for (int i = 0; i < a.count; ++i)
    for (int j = 0; j < r.count; ++j)
      sum += a.weights[i] * r.weights[j] *
             logMeans_[static_cast<size_t>((a.first + i) * meanRatios_ + r.first + j)];
  return std::exp(sum);
}

} // namespace surflect::material
