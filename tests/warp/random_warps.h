// Warps with seeded random parameters, for tests of laws that all warps obey.
#pragma once

#include "warp/warp.h"

#include <random>
#include <string>

namespace surflect {

inline Vec3<double> randomVector(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return {uniform(random), uniform(random), uniform(random)};
}

inline Vec3<double> randomUnit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Vec3<double>(normal(random), normal(random), normal(random)).normalized();
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
inline constexpr NamedWarp exactWarps[] = {{"rigid", randomRigid}, {"scale", randomScale},
                                           {"twist", randomTwist}, {"bend", randomBend},
                                           {"sine", randomSine},   {"chain", randomChain}};

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

} // namespace surflect
