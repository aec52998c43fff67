// Sparsification curve of predicted errors: the error that is left when the parts of the largest predicted
// error are taken away. The best possible curve takes away the parts of the largest true error.
//
// [Ilg 2018] Ilg, Cicek, Galesso, Klein, Makansi, Hutter, Brox: Uncertainty Estimates and Multi-Hypotheses
//            Networks for Optical Flow, ECCV.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::evaluation {

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
