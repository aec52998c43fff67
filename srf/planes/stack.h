// Photographs of one camera under many lights, one after another.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <Eigen/Core>

#include <cstdint>
#include <string>
#include <vector>

namespace surflect::planes {

// Most photographs of a stack: the work grows with the cube of their number.
inline constexpr size_t kMostPhotographs = 512;

// Training photographs of a capture of one view. Masks are not applied: a page shows whole photographs.
struct Stack {
  capture::Capture capture;        // its frames are those of the stack, in order
  std::vector<std::string> lights; // names
  // Unit directions, x right, y up, z to the camera; seen from the middle of the frontal plane.
  std::vector<Vec3<double>> towardsLights;
  std::vector<Rgb> irradiance;    // of each light there, facing it
  capture::Frame masked;          // the first frame with its mask, which shows where the object is
  std::vector<std::string> notes; // what was left out, for the user

  size_t size() const { return capture.frames.size(); }
  int width() const { return capture.views.front().camera.lens.width; }
  int height() const { return capture.views.front().camera.lens.height; }
  size_t pixels() const { return static_cast<size_t>(width()) * static_cast<size_t>(height()); }
};

// Throws Error for several views, fixed light, fewer than three lights before the camera, or more than
// kMostPhotographs of them. Lights behind the frontal plane are left out.
Stack stackOf(const capture::Capture& capture);

// A photograph divided by the irradiance of its light: 3 channels, linear. Throws Error naming the picture.
image::Image readPhotograph(const Stack& stack, size_t photograph);

// Pixels at which statistics are taken: spread over the picture by multiples of the golden section.
struct Samples {
  std::vector<size_t> pixels;  // in the order of the picture
  std::vector<uint8_t> inside; // 1 where the capture's mask shows the object; 1 everywhere without masks
  Eigen::MatrixXf linear;      // (3 #photographs) x #pixels: r, g, b of each photograph in turn
};

// Reads all photographs once; at most `most` pixels.
Samples sample(const Stack& stack, size_t most, const Progress& progress);

// Value of a channel that is shown as white: the share `below` of all positive values of inner pixels are at
// most that.
float whiteOf(const Samples& samples, double below);

} // namespace surflect::planes
