// Mistakes in the order of a table of lights, and the evidence for them: photographs that look lit by another
// light.
#pragma once

#include "srf/capture/rig.h"

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace surflect::validation {

// A mistake in the order of the lights as a whole. `lit` is the light that really lit the photographs of each
// light; none where the table ends.
struct OrderMistake {
  std::string what, cure; // "shifted by one", "look for a missing or an extra line"
  std::vector<std::optional<size_t>> lit;
};
// Shifts by up to three lines, the reversed order, and names sorted as 1, 10, 2; those that change the order.
std::vector<OrderMistake> orderMistakes(std::span<const capture::Light> lights);

// First two lights whose place another takes: "photographs of L00 look lit by L01, those of L01 by L02, .."
std::string describe(const OrderMistake& mistake, std::span<const capture::Light> lights);

// Correlations of the photographs of light l with the shading by l and by another light k: weighted sums for
// each pair (l, k), over views that both lights illuminate. Memory: four doubles a pair.
class LightEvidence {
public:
  explicit LightEvidence(size_t lights);

  // Adds a photograph of light l: its correlation with the shading by l and by k, the correlation between
  // these shadings, and its weight, such as the number of pixels.
  void add(size_t l, size_t k, double own, double other, double alike, double weight);
  void add(const LightEvidence& further);

  // Improvement of the correlation by k instead of l, relative to the most that it can be: 1 if k lit a
  // Lambert surface without shadows, -1 if l did. None if l and k look alike, or without enough weight.
  std::optional<double> gain(size_t l, size_t k, double fewest) const;
  // Gain of a mistake: improvement over all its lights, relative to the most that it can be.
  std::optional<double> gain(const OrderMistake& mistake, double fewest) const;
  // Mean correlation of the photographs of l with the shading by k; none without enough weight.
  std::optional<double> correlation(size_t l, size_t k, double fewest) const;
  // Mean correlation by the lights as stated, and by another: k instead of l, or all of a mistake.
  std::pair<double, double> correlations(size_t l, size_t k) const;
  std::pair<double, double> correlations(const OrderMistake& mistake) const;

private:
  Eigen::MatrixXd own_, other_, apart_, weight_;
};

// Mistake with the largest gain above kLikelierLight, if there is one.
std::optional<OrderMistake> likeliestMistake(const LightEvidence& evidence,
                                             std::span<const capture::Light> lights, double fewest);

// Pairs of lights of which each fits the photographs of the other, the clearest first; a light is in one
// pair.
std::vector<std::pair<size_t, size_t>> exchangedPairs(const LightEvidence& evidence, size_t lights,
                                                      double fewest);

// Gain from which on another light is the likelier one. Between right and exchanged lights it is -1 to 1.
inline constexpr double kLikelierLight = 0.3;

} // namespace surflect::validation
