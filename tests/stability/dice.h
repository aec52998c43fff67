// Seeded random numbers and cameras of the programs that fuzz frames.
#pragma once

#include "srf/capture/camera.h"
#include "tests/support/random.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <random>

namespace surflect::stability {

class Dice {
public:
  explicit Dice(unsigned seed) : random_(seed) {}
  double within(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  // Its logarithm is even.
  double scale(double low, double high) { return std::exp(within(std::log(low), std::log(high))); }
  int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }
  bool isRare() { return below(6) == 0; }
  Vec3<double> unit() { return randomUnit(random_); }

private:
  std::mt19937 random_;
};

// Looks past a place, from far away or from within; pictures have size x size pixels.
inline capture::Camera<ObjectSpace> randomCamera(Dice& dice, const Vec3<double>& place, int size) {
  auto camera = studio::cameraFrom<ObjectSpace>(dice.unit(), size);
  if (dice.isRare()) camera.lens.model = capture::Lens::Model::orthographic;
  const double distance = dice.isRare() ? dice.scale(1e-3, 1e6) : dice.within(0, 6);
  const Mat3<double> rotation = camera.cameraFromWorld.rotation();
  camera.cameraFromWorld = {rotation, Vec3<double>(dice.within(-1, 1), dice.within(-1, 1), -distance) -
                                          rotation * place};
  camera.lens.focalX = camera.lens.focalY = dice.isRare() ? dice.scale(0.5, 1e4) : dice.within(8, 60);
  return camera;
}

} // namespace surflect::stability
