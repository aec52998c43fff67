// Principal planes of photographs: few pictures whose weighted sums are the photographs of one view under
// many lights.
//
// [Pearson 1901] K. Pearson: On Lines and Planes of Closest Fit to Systems of Points in Space.
// [Malzbender 2001] T. Malzbender, D. Gelb, H. Wolters: Polynomial Texture Maps, SIGGRAPH: one function of
// the light a pixel. Here the functions are those that the photographs themselves have in common.
//
//   e_lc(x) ~ m_lc + sum_k B_lck a_k(x)
//
// Symbols: x pixel, l photograph, c channel, e encoded value, m mean, B orthonormal columns (#photographs x 3
// rows), a_k plane k.
#pragma once

#include "srf/planes/stack.h"
#include "surfel/base/time.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <vector>

namespace surflect::planes {

// Encoding in which errors are about as visible in dark as in bright pixels: a square root whose slope at
// black is that of sRGB. Its inverse costs two products.
inline const float kToe = std::sqrt(0.0015f);

inline float encoded(float linear) { return std::sqrt(std::clamp(linear, 0.f, 1.f) + kToe * kToe) - kToe; }
inline float decoded(float encoded) {
  const float root = std::max(encoded + kToe, kToe);
  return root * root - kToe * kToe;
}

// Encoded samples, of values divided by white.
Eigen::MatrixXf encodedSamples(const Samples& samples, float white);

// Sums over samples, from which a basis of all photographs, or of all but some, is found.
struct Moments {
  Eigen::VectorXd mean;       // 3 #photographs
  Eigen::MatrixXd covariance; // square
};
Moments momentsOf(const Eigen::MatrixXf& encoded);

struct Basis {
  Eigen::VectorXf mean;    // m
  Eigen::MatrixXf vectors; // B: each column's largest component is positive

  Eigen::Index planes() const { return vectors.cols(); }
};
// Basis of the largest variances [Pearson 1901]; fewer planes where there are not so many dimensions.
Basis principalBasis(const Moments& moments, Eigen::Index planes);

// The planes of a picture.
struct Planes {
  int width = 0, height = 0;
  std::vector<std::vector<float>> values; // a_k, width * height each, row 0 on top

  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

// a_k = sum_lc B_lck (e_lc - m_lc). Reads one photograph after another, and holds the planes and one
// photograph.
Planes projected(const Stack& stack, const Basis& basis, float white, const Progress& progress);

// Each pixel is the mean of up to 2 x 2 pixels.
Planes halved(const Planes& planes);

} // namespace surflect::planes
