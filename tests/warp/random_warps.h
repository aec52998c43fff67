// Warps with seeded random parameters, for tests of laws that all warps obey.
#pragma once

#include "tests/support/random.h"
#include "warp/handles.h"
#include "warp/lattice.h"
#include "warp/warp.h"

#include <random>
#include <string>

namespace surflect::warp {

inline Vec3<double> randomVector(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return {uniform(random), uniform(random), uniform(random)};
}

inline double randomBetween(double least, double most, std::mt19937& random) {
  return std::uniform_real_distribution<double>(least, most)(random);
}

inline WarpPointer randomRigid(std::mt19937& random) {
  return rigidWarp(randomUnit(random), Angle::fromRadians(randomBetween(-3, 3, random)), randomVector(random),
                   randomVector(random));
}
// Factors of 0.5 to 2, any of them negative.
inline WarpPointer randomScale(std::mt19937& random) {
  Vec3<double> factors;
  for (double& factor : factors) factor = randomBetween(0.5, 2, random) * (random() & 1 ? 1 : -1);
  return scaleWarp(factors, randomVector(random));
}
inline WarpPointer randomTwist(std::mt19937& random) {
  return twistWarp(randomUnit(random), Angle::fromRadians(randomBetween(-2, 2, random)),
                   randomVector(random));
}
inline WarpPointer randomBend(std::mt19937& random) {
  const Vec3<double> axis = randomUnit(random), direction = axis.cross(randomUnit(random)).normalized();
  return bendWarp(axis, direction, Angle::fromRadians(randomBetween(-2, 2, random)), randomVector(random));
}
inline WarpPointer randomSine(std::mt19937& random) {
  return sineWarp({.axis = randomUnit(random),
                   .direction = randomUnit(random),
                   .center = randomVector(random),
                   .amplitude = randomBetween(-0.5, 0.5, random),
                   .wavelength = randomBetween(1, 4, random),
                   .phase = Angle::fromRadians(randomBetween(-3, 3, random))});
}
inline WarpPointer randomTaper(std::mt19937& random) {
  return taperWarp(randomUnit(random), randomBetween(-1, 1, random), randomVector(random));
}
// Over a box of side 2.2 to 2.6 about the origin, with up to 4 divisions an axis.
inline Lattice randomLattice(std::mt19937& random) {
  Lattice lattice;
  lattice.least = Vec3<double>::Constant(-1.2) + 0.1 * randomVector(random);
  lattice.most = Vec3<double>::Constant(1.2) + 0.1 * randomVector(random);
  for (int& n : lattice.divisions) n = 1 + static_cast<int>(random() % 4);
  for (size_t i = 0; i < lattice.pointCount(); ++i) lattice.moves.push_back(0.1 * randomVector(random));
  return lattice;
}
inline WarpPointer randomLatticeWarp(std::mt19937& random) { return latticeWarp(randomLattice(random)); }

inline std::vector<Vec3<double>> randomPoints(size_t count, std::mt19937& random) {
  std::vector<Vec3<double>> points;
  for (size_t i = 0; i < count; ++i) points.push_back(randomVector(random));
  return points;
}
// Near the corners of a cube, so that no two are close.
inline std::vector<Vec3<double>> randomCorners(std::mt19937& random) {
  std::vector<Vec3<double>> corners;
  for (int i = 0; i < 8; ++i)
    corners.push_back(Vec3<double>(i & 1 ? 0.7 : -0.7, i & 2 ? 0.7 : -0.7, i & 4 ? 0.7 : -0.7) +
                      0.3 * randomVector(random));
  return corners;
}
inline WarpPointer randomHandlesWarp(std::mt19937& random, std::optional<double> radius) {
  const auto rest = randomCorners(random);
  auto targets = rest;
  for (Vec3<double>& target : targets) target += 0.2 * randomVector(random);
  return Handles(rest, radius).pullTo(targets);
}
inline WarpPointer randomHandles(std::mt19937& random) { return randomHandlesWarp(random, std::nullopt); }
inline WarpPointer randomLocalHandles(std::mt19937& random) {
  return randomHandlesWarp(random, randomBetween(1, 2, random));
}
inline WarpPointer randomChain(std::mt19937& random) {
  std::vector<WarpPointer> links;
  links.push_back(randomBend(random));
  links.push_back(randomScale(random));
  links.push_back(randomTwist(random));
  links.push_back(randomRigid(random));
  links.push_back(randomSine(random));
  return chainWarp(std::move(links));
}

struct NamedWarp {
  const char* name;
  WarpPointer (*make)(std::mt19937&);
};
// All that have an exact Jacobian.
inline constexpr NamedWarp exactWarps[] = {
    {"rigid", randomRigid},         {"scale", randomScale},     {"twist", randomTwist},
    {"bend", randomBend},           {"sine", randomSine},       {"taper", randomTaper},
    {"lattice", randomLatticeWarp}, {"handles", randomHandles}, {"local handles", randomLocalHandles},
    {"chain", randomChain}};

inline WarpPointer formulas(const std::string& x, const std::string& y, const std::string& z,
                            const ShotTime& time = {}) {
  return expressionWarp(Expression(x, warpVariables), Expression(y, warpVariables),
                        Expression(z, warpVariables), time);
}

inline WarpPointer chainOf(WarpPointer first, WarpPointer second) {
  std::vector<WarpPointer> links;
  links.push_back(std::move(first));
  links.push_back(std::move(second));
  return chainWarp(std::move(links));
}

} // namespace surflect::warp
