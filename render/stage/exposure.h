// The camera of 8 bits of a stage whose photographs are exposure brackets.
//
//   x  exposure: radiance times seconds     x1  that of the last code: the sensor is full
//   N  electrons
#pragma once

#include "render/stage/random.h"
#include "srf/image/image.h"
#include "srf/image/response.h"

#include <cstdint>
#include <string>
#include <vector>

namespace surflect::stage {

struct StageExposure {
  std::vector<double> seconds; // of each picture of a bracket; no two are equal
  image::Response response;    // the same for red, green and blue
  bool isSrgb = true;          // the response is the sRGB curve
  double fullWell = 0;         // electrons of a full sensor; 0: no noise of photons
  double readNoise = 0;        // electrons, standard deviation
};

// The code that stands for the exposure nearest to x; the last one for all that is more.
uint8_t codeOf(const image::Response& response, float x);

// x as the sensor counts it: N = fullWell x / x1 electrons, plus a normal variable of variance N +
// readNoise^2.
double sensed(double x, const StageExposure& camera, Random& random);

// One picture of a bracket: RGBA, codes over 255, alpha straight. `radiance` has 3 channels and is not
// multiplied by `alpha`. Its noise is that of the seed, view, light and shot.
struct BracketShot {
  uint64_t seed, view, light, shot;
};
image::Image exposed(const image::Image& radiance, const image::Image& alpha, const StageExposure& camera,
                     const BracketShot& shot);

} // namespace surflect::stage
