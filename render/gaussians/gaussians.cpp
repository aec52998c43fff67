#include "render/gaussians/gaussians.h"

#include "srf/image/color.h"
#include "surfel/math/sphere_sampling.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace surflect::gaussians {

namespace {

// Directions all around. A surfel faces half of them, fewer than 90 degrees less kLeastCosine away: about 28
// for the 16 coefficients of degree 3.
constexpr size_t kDirections = 64;

// Number of turned copies of the directions. Neighbours have different ones, and their blend all of them.
constexpr size_t kTurns = 8;

// The k-th turn: axes and angles follow a golden spiral.
Mat3<double> turnOf(size_t k) {
  const double angle = 2.399963 * static_cast<double>(k); // golden angle
  return Eigen::AngleAxisd(angle, fibonacciSphere(kTurns)[k]).toRotationMatrix();
}

// Turn of a surfel, by its index in the drawn cloud.
size_t turnFor(uint32_t surfel) { return (surfel * uint32_t{2654435769u}) >> 29; } // Fibonacci hashing
static_assert(kTurns == size_t{1} << (32 - 29));

// Cosine to the normal at which a direction begins to count.
constexpr double kLeastCosine = 0.1;

// Encoded colour of radiance that is not premultiplied.
Color encoded(Rgb radiance, double scale) {
  const auto encode = [&](float value) {
    const double linear = std::clamp(scale * value, 0.0, 1.0);
    return double{image::srgbFromLinear(static_cast<float>(linear))};
  };
  return {encode(radiance.r), encode(radiance.g), encode(radiance.b)};
}

struct Ellipse {
  Vec3<double> major, minor; // unit
  double longer, shorter;    // half-axes
};

// Principal axes of the ellipse a u + b v, a^2 + b^2 = 1.
Ellipse principalAxes(const Vec3<double>& u, const Vec3<double>& v) {
  Eigen::Matrix<double, 3, 2> tangents;
  tangents << u, v;
  const Eigen::JacobiSVD<Eigen::Matrix<double, 3, 2>> svd(tangents, Eigen::ComputeFullU);
  return {svd.matrixU().col(0), svd.matrixU().col(1), svd.singularValues()[0], svd.singularValues()[1]};
}

} // namespace

Shape shapeOf(const Point3<ObjectSpace>& p, const Direction3<ObjectSpace>& u,
              const Direction3<ObjectSpace>& v, Handedness handedness, float radius) {
  assert(handedness != Handedness::dead);
  const Vec3<double> ju = u.raw().cast<double>(), jv = v.raw().cast<double>();
  const auto [major, minor, longer, shorter] = principalAxes(ju, jv);
  const double side = handedness == Handedness::mirrored ? -1 : 1;
  Mat3<double> axes;
  axes.col(0) = major;
  axes.col(2) = side * ju.cross(jv).normalized();
  axes.col(1) = axes.col(2).cross(major); // along `minor` or against it, so that the axes are right-handed
  Eigen::Quaterniond turn(axes);
  if (turn.w() < 0) turn.coeffs() *= -1;
  const double deviation = kDeviationPerRadius * radius;
  Shape shape;
  shape.center = p.raw();
  shape.normal = axes.col(2).cast<float>();
  shape.scale = {static_cast<float>(deviation * longer), static_cast<float>(deviation * shorter),
                 static_cast<float>(kThickness * deviation * shorter)};
  shape.rotation = {static_cast<float>(turn.w()), static_cast<float>(turn.x()), static_cast<float>(turn.y()),
                    static_cast<float>(turn.z())};
  return shape;
}

Shape nearestTo(const Shape& other, const Shape& shape) {
  const auto asTurn = [](const Shape& of) {
    return Eigen::Quaterniond(of.rotation[0], of.rotation[1], of.rotation[2], of.rotation[3]);
  };
  const Eigen::Quaterniond target = asTurn(other);
  Shape nearest = shape;
  double most = -1;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const Eigen::AngleAxisd about(quarter * std::numbers::pi / 2, Vec3<double>::UnitZ());
    Eigen::Quaterniond turn = asTurn(shape) * about;
    double likeness = turn.dot(target);
    if (likeness < 0) turn.coeffs() *= -1, likeness = -likeness;
    if (likeness <= most) continue;
    most = likeness;
    nearest.rotation = {static_cast<float>(turn.w()), static_cast<float>(turn.x()),
                        static_cast<float>(turn.y()), static_cast<float>(turn.z())};
    nearest.scale = shape.scale;
    if (quarter % 2 == 1) std::swap(nearest.scale[0], nearest.scale[1]);
  }
  return nearest;
}

Gaussians::Gaussians(const surfels::OutgoingRadiance& radiance, double exposure)
    : radiance_(radiance), exposure_(exposure) {
  const DeformedCloud& deformed = radiance.deformed();
  for (uint32_t i = 0; i < deformed.size(); ++i)
    if (deformed.handedness[i] != Handedness::dead && radiance.cloud().radius[i] > 0) alive_.push_back(i);
}

Shape Gaussians::shape(size_t i) const {
  const uint32_t surfel = alive_[i];
  const DeformedCloud& deformed = radiance_.deformed();
  return shapeOf(deformed.p[surfel], deformed.u[surfel], deformed.v[surfel], deformed.handedness[surfel],
                 radiance_.cloud().radius[surfel]);
}

std::vector<Look> Gaussians::looks(size_t begin, size_t end, int degree, const Progress& progress) const {
  assert(begin <= end && end <= size());
  const std::vector<Vec3<double>> sphere = fibonacciSphere(kDirections);
  using Harmonics = std::array<double, kMostCoefficients>;
  std::array<std::vector<Vec3<double>>, kTurns> viewers; // by turn
  std::array<std::vector<Harmonics>, kTurns> harmonics;
  for (size_t turn = 0; turn < kTurns; ++turn)
    for (const Vec3<double>& direction : sphere) {
      viewers[turn].push_back((turnOf(turn) * direction).normalized());
      harmonics[turn].push_back(harmonicsAt(-viewers[turn].back()));
    }

  // Sample k of a surfel is its colour towards viewer k of its turn, with weight 0 where it faces away.
  const size_t count = end - begin;
  std::vector<float> samples(4 * count * kDirections);
  std::vector<Vec3<float>> normals;
  for (size_t i = begin; i < end; ++i) normals.push_back(shape(i).normal);
  std::array<std::vector<uint32_t>, kTurns> turned; // places of the surfels of each turn
  for (size_t i = 0; i < count; ++i) turned[turnFor(alive_[begin + i])].push_back(static_cast<uint32_t>(i));
  std::vector<uint32_t> facing, places;
  for (size_t step = 0; step < kTurns * kDirections; ++step) {
    const size_t turn = step / kDirections, k = step % kDirections;
    progress(kStage, static_cast<double>(step) / (kTurns * kDirections));
    facing.clear();
    places.clear();
    for (const uint32_t place : turned[turn]) {
      if (normals[place].cast<double>().dot(viewers[turn][k]) < kLeastCosine) continue;
      facing.push_back(alive_[begin + place]);
      places.push_back(place);
    }
    if (facing.empty()) continue;
    const shading::Shaded shaded = radiance_.towards(
        assume<Direction3<ObjectSpace, double>>(viewers[turn][k]), facing, {{}, progress.cancelled});
    for (size_t f = 0; f < facing.size(); ++f) {
      const double alpha = shaded.alpha.empty() ? 1 : shaded.alpha[f];
      if (!(alpha > 0)) continue;
      const Color color = encoded(shaded.radiance[f], exposure_ / alpha);
      float* sample = &samples[4 * (places[f] * kDirections + k)];
      for (size_t channel = 0; channel < 3; ++channel) sample[channel] = static_cast<float>(color[channel]);
      sample[3] = static_cast<float>(alpha);
    }
  }

  std::vector<Look> looks(count);
  tbb::parallel_for(size_t{0}, count, [&](size_t i) {
    progress.checkNowAndThen(i);
    const size_t turn = turnFor(alive_[begin + i]);
    std::vector<Color> colors(kDirections);
    std::vector<double> weights(kDirections);
    double seen = 0, covered = 0;
    for (size_t k = 0; k < kDirections; ++k) {
      const float* sample = &samples[4 * (i * kDirections + k)];
      const double cosine = normals[i].cast<double>().dot(viewers[turn][k]);
      if (cosine < kLeastCosine) continue;
      colors[k] = {sample[0], sample[1], sample[2]};
      weights[k] = cosine * sample[3];
      seen += cosine;
      covered += weights[k];
    }
    looks[i].color = fitted(harmonics[turn], colors, weights, degree);
    looks[i].opacity = seen > 0 ? static_cast<float>(kOpacity * covered / seen) : 0;
  });
  return looks;
}

} // namespace surflect::gaussians
