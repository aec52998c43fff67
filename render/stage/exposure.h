// 8-bit camera of a stage whose photographs are exposure brackets.
//
//   x  exposure: radiance times seconds     x1  exposure of the last code, where the sensor is full
//   N  electrons
#pragma once

#include "render/scene/script_fields.h"
#include "render/stage/random.h"
#include "srf/image/bracket.h"
#include "srf/image/image.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace surflect::stage {

struct StageExposure {
  std::vector<double> seconds; // one per picture of a bracket; all differ
  image::Response response;    // equal for red, green and blue
  bool isSrgb = true;          // the response is the sRGB curve
  double fullWell = 0;         // electrons of a full sensor; 0: no photon noise
  double readNoise = 0;        // electrons, standard deviation
};

// Code whose exposure is nearest to x; the last code for larger exposures.
uint8_t codeOf(const image::Response& response, float x);

// Noisy exposure: N = fullWell x / x1 electrons, plus a normal variable of variance N + readNoise^2.
double sensed(double x, const StageExposure& camera, Random& random);

// One picture of a bracket: RGBA, codes over 255, straight alpha. `radiance` has 3 channels, not multiplied
// by `alpha`. The noise depends on seed, view, light and shot.
struct BracketShot {
  uint64_t seed, view, light, shot;
};
image::Image exposed(const image::Image& radiance, const image::Image& alpha, const StageExposure& camera,
                     const BracketShot& shot);

// Reads the [exposure] section of a stage file.
struct ExposureSection {
  StageExposure camera;
  std::vector<std::filesystem::path> files; // files that were read
};

// Throws Error naming the entry.
ExposureSection asExposure(const scene::Entry& entry);

} // namespace surflect::stage
