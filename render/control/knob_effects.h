// Model of what knobs do to a frame: errors add like vectors, costs multiply within each stage.
//
//   error(s)^2 = (1 - c) sum_k w_k e_k(s_k)^2 + c (sum_k sqrt(w_k) e_k(s_k))^2
//   cost(s)    = sum_j c_j prod_k r_kj(s_k)
//
// Symbols: s_k step of knob k, 0 is full; e_k relative RMS error of the picture with knob k alone at this
// step; w_k correction of the frame, 1 until measured; c correlation between the errors of two knobs, 0 until
// measured; c_j cost of stage j at full; r_kj ratio by which the step multiplies it.
#pragma once

#include "render/method/option.h"
#include "srf/image/image.h"

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace surflect::control {

// Error of a picture relative to its reference, in linear light.

// sqrt(sum |a - b|^2 / sum |b|^2) over red, green and blue of all pixels, for pictures of the same size with
// at least three channels. 0 if both are equal, infinite if only b is black.
double relativeRms(const image::Image& a, const image::Image& b);

// A step of each knob.
using Steps = std::vector<size_t>;

struct StepEffect {
  method::Value value = 0;    // of the knob
  double squaredError = 0;    // e_k^2
  std::vector<double> ratios; // r_kj, one per stage
};

// Steps of one knob, from full (error 0, all ratios 1) to the fastest.
using KnobEffects = std::vector<StepEffect>;

struct FrameModel {
  std::vector<double> stageCosts; // c_j
  std::vector<double> weights;    // w_k
  double correlation = 0;         // c, 0..1
};

// The two sums of the error, over some of the knobs.
struct ErrorSums {
  double ofSquares = 0, ofErrors = 0;

  void add(double weight, const StepEffect& step) {
    ofSquares += weight * step.squaredError;
    ofErrors += std::sqrt(weight * step.squaredError);
  }
  double squaredError(double correlation) const {
    return (1 - correlation) * ofSquares + correlation * ofErrors * ofErrors;
  }
};

double squaredError(std::span<const KnobEffects> knobs, const FrameModel& frame, const Steps& steps);
double cost(std::span<const KnobEffects> knobs, const FrameModel& frame, const Steps& steps);

// Changes weights and correlation as little as possible so that the model gives a measured error [Kaczmarz
// 1937: projection onto one equation, here repeated as it is not quite linear]. A weight never falls below a
// hundredth. A single knob leaves the correlation as it is.
void correct(std::span<const KnobEffects> knobs, const Steps& steps, double measuredSquaredError,
             FrameModel& frame);

// Returns whether no step of `a` is smaller than that of `b`: a is at least as fast, and hardly more
// accurate.
bool isAtLeastAsFast(const Steps& a, const Steps& b);

} // namespace surflect::control
