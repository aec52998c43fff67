// Spearman's rank correlation: whether one quantity orders things as another does, on whatever scales.
//
//   rho = correlation of R(a) and R(b)                                              [Spearman 1904]
//
// Symbols: R(x) rank of each value among all, 0 for the least; equal values share the mean of their ranks.
//
// [Spearman 1904] Spearman: The Proof and Measurement of Association between Two Things, American Journal of
//                 Psychology 15.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace surflect::evaluation {

// R(x). Values must not be NaN.
std::vector<double> ranksOf(std::span<const double> values);

// rho, -1..1: 1 if both have the same order, -1 if opposite orders. Nothing if one of them is constant. Both
// have the same length.
std::optional<double> rankCorrelation(std::span<const double> a, std::span<const double> b);

} // namespace surflect::evaluation
