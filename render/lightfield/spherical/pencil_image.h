// Image of a pencil: the object projected in parallel along one direction, with its heights and mip levels.
//
// [Domingo 2007, §3.1]
//
// The image plane passes through the middle of the object, orthogonal to the direction d. Texture coordinates
// s (rightwards) and t (downwards) span 0..1 over the square around the object's sphere; heights are those
// above the plane, towards the viewer, in the same unit: -1/2..1/2. Coordinates (s, t, height) are called a
// place in the image.
#pragma once

#include "surfel/math/space.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::spherical {

inline constexpr int kLeastSize = 8, kLargestSize = 1024; // of an image's side, texels; a power of two

// Half floats: linear radiance r, g, b times alpha, and alpha. All are finite; alpha is 0..1.
using Texel = std::array<uint16_t, 4>;
// 0..65535 for -1/2..1/2. Heights of texels beside the object continue those on it.
using Height = uint16_t;
Height heightOf(double value);
constexpr double valueOf(Height height) { return height / 65535.0 - 0.5; }

struct MipLevel {
  int size = 0; // of a side, texels
  std::vector<Texel> colors;
  std::vector<float> heights; // as valueOf() gives them
};

// Level 0 is the largest; each further one is half as large, down to one texel.
struct PencilImage {
  std::vector<MipLevel> mips;
};

// An image with all its levels from the texels and heights of the largest. A texel of a level is the mean of
// four; its height is their mean by alpha, or their plain mean if all are transparent.
PencilImage mipmapped(int size, std::vector<Texel> colors, std::vector<Height> heights);

// Bytes of an image of this size, in main memory and on the GPU.
size_t imageBytes(int size);

// Sphere that holds the object.
struct Sphere {
  Vec3<double> middle = Vec3<double>::Zero(); // in acquisition space
  double radius = 1;
};

// Orthonormal axes of an image: u rightwards, v upwards, d towards the viewer.
struct ImageAxes {
  Vec3<double> u, v, d;
};
ImageAxes axesOf(const Vec3<double>& direction);

// Place of a point of acquisition space, and the vector of a direction, in an image around a sphere.
Vec3<double> placeOf(const Sphere& sphere, const ImageAxes& axes, const Vec3<double>& point);
Vec3<double> vectorOf(const Sphere& sphere, const ImageAxes& axes, const Vec3<double>& direction);
// Inverse of placeOf().
Vec3<double> pointOf(const Sphere& sphere, const ImageAxes& axes, const Vec3<double>& place);

// Trilinear samples between texel centres, and between levels: `mip` is 0 for the largest. Beyond the image,
// the texels of its border continue.
Eigen::Vector4d colorAt(const PencilImage& image, const Vec2<double>& place, double mip);
double heightAt(const PencilImage& image, const Vec2<double>& place, double mip);

} // namespace surflect::spherical
