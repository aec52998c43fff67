// Diagnostics of a film that renders but is most likely wrong, as messages for the user.
#pragma once

#include "render/scene/scene.h"
#include "srf/image/image.h"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::evaluation {

// Share of a picture that can be trusted, by its predicted errors.

// A pixel is trusted if its predicted error, RMS over the channels in linear light, is at most this part of
// the picture's white.
inline constexpr double kTrustedError = 10 / 255.;

// Numbers of pixels with alpha above 1/2 and of trusted pixels among them, in one or more pictures.
struct Trust {
  size_t pixels = 0, trusted = 0;

  double share() const { return pixels > 0 ? static_cast<double>(trusted) / static_cast<double>(pixels) : 1; }
  Trust& operator+=(const Trust& other) {
    pixels += other.pixels;
    trusted += other.trusted;
    return *this;
  }
};

// color: RGBA; predictedError: one channel; white: radiance of white. Both images have one size.
Trust trustIn(const image::Image& color, const image::Image& predictedError, double white);

// Reports the first mesh or skeleton warp whose rest mesh does not lie around the object: its box is that of
// the object only when y and z are exchanged, or it does not reach more than a tenth of the object's points
// (MeshField::reaches), as happens when units or axes differ; or its cache begins with it in another place
// (MeshSequence::displacement). Examines at most a few thousand points. Throws Error as warp::evaluateAt.
std::optional<std::string> misplacedRestMesh(const scene::Script& script, const warp::ShotTime& time,
                                             std::span<const Point3<AcquisitionSpace>> object);

// Sparsification curve of predicted errors: the error that is left when the parts of the largest predicted
// error are taken away. The best possible curve takes away the parts of the largest true error.
//
// [Ilg 2018] Ilg, Cicek, Galesso, Klein, Makansi, Hutter, Brox: Uncertainty Estimates and Multi-Hypotheses
//            Networks for Optical Flow, ECCV.

// Spearman's rank correlation: whether one quantity orders things as another does, on whatever scales.
//   rho = correlation of R(a) and R(b)                                              [Spearman 1904]
// Symbols: R(x) rank of each value among all, 0 for the least; equal values share the mean of their ranks.
// [Spearman 1904] Spearman: The Proof and Measurement of Association between Two Things, American Journal of
//                 Psychology 15.

// R(x). Values must not be NaN.
std::vector<double> ranksOf(std::span<const double> values);

// rho, -1..1: 1 if both have the same order, -1 if opposite orders. Nothing if one of them is constant. Both
// have the same length.
std::optional<double> rankCorrelation(std::span<const double> a, std::span<const double> b);

// RMS of the true errors that are left, at shares 0, 1 / steps, ... (steps - 1) / steps taken away.
struct Sparsification {
  std::vector<double> byPrediction, best;
};

// error, predicted: one RMS error per part, of the same length; steps >= 1. Parts of equal predicted error
// are taken away in equal shares, so that a constant prediction leaves a flat curve. Both curves are empty
// without parts.
Sparsification sparsify(std::span<const double> error, std::span<const double> predicted, size_t steps);

// Mean height of the curve by prediction over the best one, relative to the error of all parts [Ilg 2018]: 0
// for a perfect order of the parts. 0 if there is no error.
double sparsificationError(const Sparsification& curves);

} // namespace surflect::evaluation
