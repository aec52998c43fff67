#include "srf/validation/light_order.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace surflect::validation {

namespace {

constexpr double kTellable = 0.02; // 1 - correlation of two shadings; below, noise decides
constexpr double kNearBest = 0.15; // correlations
constexpr int kFarthestShift = 3;  // lines

size_t differences(const OrderMistake& mistake) {
  size_t count = 0;
  for (size_t l = 0; l < mistake.lit.size(); ++l) count += mistake.lit[l] && *mistake.lit[l] != l;
  return count;
}

// Mistake of a table whose names were sorted in one way, while its vectors follow the other.
OrderMistake sortedOtherwise(std::span<const capture::Light> lights, bool vectorsAreNatural) {
  std::vector<size_t> natural(lights.size());
  std::iota(natural.begin(), natural.end(), size_t{0});
  std::vector<size_t> byLetters = natural;
  // Names that end in numbers sort as these do by length first.
  std::ranges::stable_sort(natural, {},
                           [&](size_t l) { return std::pair(lights[l].name.size(), lights[l].name); });
  std::ranges::stable_sort(byLetters, [&](size_t a, size_t b) { return lights[a].name < lights[b].name; });
  OrderMistake mistake{vectorsAreNatural ? "sorted as 1, 10, 2" : "sorted as 1, 2, 10",
                       vectorsAreNatural ? "name its lines in the order 1, 2, 10"
                                         : "name its lines in the order 1, 10, 2",
                       std::vector<std::optional<size_t>>(lights.size())};
  const std::vector<size_t>&names = vectorsAreNatural ? byLetters : natural,
        &vectors = vectorsAreNatural ? natural : byLetters;
  // Line i has name names[i], and the vector of the light that is really called vectors[i].
  for (size_t i = 0; i < lights.size(); ++i) mistake.lit[vectors[i]] = names[i];
  return mistake;
}

} // namespace

std::vector<OrderMistake> orderMistakes(std::span<const capture::Light> lights) {
  const auto count = static_cast<int>(lights.size());
  std::vector<OrderMistake> mistakes;
  for (int lines = 1; lines <= kFarthestShift; ++lines)
    for (const int shift : {lines, -lines}) {
      OrderMistake& mistake = mistakes.emplace_back(OrderMistake{
          lines == 1 ? "shifted by one" : "shifted by " + std::to_string(lines),
          "look for a line too many or missing before its first light, or for numbers that start "
          "at 0 in one place and at 1 in another",
          std::vector<std::optional<size_t>>(lights.size())});
      for (int l = 0; l < count; ++l)
        if (l + shift >= 0 && l + shift < count)
          mistake.lit[static_cast<size_t>(l)] = static_cast<size_t>(l + shift);
    }
  OrderMistake& reversed = mistakes.emplace_back(
      OrderMistake{"reversed", "reverse its lines", std::vector<std::optional<size_t>>(lights.size())});
  for (size_t l = 0; l < lights.size(); ++l) reversed.lit[l] = lights.size() - 1 - l;
  for (const bool vectorsAreNatural : {true, false})
    mistakes.push_back(sortedOtherwise(lights, vectorsAreNatural));
  std::erase_if(mistakes, [](const OrderMistake& mistake) { return differences(mistake) < 3; });
  return mistakes;
}

std::string describe(const OrderMistake& mistake, std::span<const capture::Light> lights) {
  std::string text;
  size_t told = 0;
  for (size_t l = 0; l < mistake.lit.size() && told < 2; ++l)
    if (mistake.lit[l] && *mistake.lit[l] != l)
      text += fmt::format("{} {} look lit by {}", told++ == 0 ? "photographs of" : ", those of",
                          lights[l].name, lights[*mistake.lit[l]].name);
  return text + ", ..";
}

LightEvidence::LightEvidence(size_t lights) {
  const auto n = static_cast<Eigen::Index>(lights);
  own_ = other_ = apart_ = weight_ = Eigen::MatrixXd::Zero(n, n);
}

void LightEvidence::add(size_t l, size_t k, double own, double other, double alike, double weight) {
  const auto row = static_cast<Eigen::Index>(l), column = static_cast<Eigen::Index>(k);
  own_(row, column) += weight * own;
  other_(row, column) += weight * other;
  apart_(row, column) += weight * (1 - alike);
  weight_(row, column) += weight;
}

void LightEvidence::add(const LightEvidence& further) {
  own_ += further.own_;
  other_ += further.other_;
  apart_ += further.apart_;
  weight_ += further.weight_;
}

std::optional<double> LightEvidence::gain(size_t l, size_t k, double fewest) const {
  const auto row = static_cast<Eigen::Index>(l), column = static_cast<Eigen::Index>(k);
  const double weight = weight_(row, column), apart = apart_(row, column);
  if (!(weight >= fewest) || !(apart > kTellable * weight)) return std::nullopt;
  return (other_(row, column) - own_(row, column)) / apart;
}

std::optional<double> LightEvidence::gain(const OrderMistake& mistake, double fewest) const {
  double improvement = 0, apart = 0, weight = 0;
  for (size_t l = 0; l < mistake.lit.size(); ++l) {
    if (!mistake.lit[l] || *mistake.lit[l] == l) continue;
    const auto row = static_cast<Eigen::Index>(l), column = static_cast<Eigen::Index>(*mistake.lit[l]);
    improvement += other_(row, column) - own_(row, column);
    apart += apart_(row, column);
    weight += weight_(row, column);
  }
  if (!(weight >= fewest) || !(apart > kTellable * weight)) return std::nullopt;
  return improvement / apart;
}

std::optional<double> LightEvidence::correlation(size_t l, size_t k, double fewest) const {
  const auto row = static_cast<Eigen::Index>(l), column = static_cast<Eigen::Index>(k);
  if (!(weight_(row, column) >= fewest)) return std::nullopt;
  return other_(row, column) / weight_(row, column);
}

std::pair<double, double> LightEvidence::correlations(size_t l, size_t k) const {
  const auto row = static_cast<Eigen::Index>(l), column = static_cast<Eigen::Index>(k);
  return {own_(row, column) / weight_(row, column), other_(row, column) / weight_(row, column)};
}

std::pair<double, double> LightEvidence::correlations(const OrderMistake& mistake) const {
  double own = 0, other = 0, weight = 0;
  for (size_t l = 0; l < mistake.lit.size(); ++l) {
    if (!mistake.lit[l]) continue;
    const auto row = static_cast<Eigen::Index>(l), column = static_cast<Eigen::Index>(*mistake.lit[l]);
    own += own_(row, column);
    other += other_(row, column);
    weight += weight_(row, column);
  }
  return {own / weight, other / weight};
}

std::optional<OrderMistake> likeliestMistake(const LightEvidence& evidence,
                                             std::span<const capture::Light> lights, double fewest) {
  std::optional<OrderMistake> likeliest;
  double most = kLikelierLight;
  for (const OrderMistake& mistake : orderMistakes(lights)) {
    const auto gain = evidence.gain(mistake, fewest);
    if (!gain || !(*gain > most)) continue;
    most = *gain;
    likeliest = mistake;
  }
  return likeliest;
}

std::vector<std::pair<size_t, size_t>> exchangedPairs(const LightEvidence& evidence, size_t lights,
                                                      double fewest) {
  struct Pair {
    size_t a, b;
    double gain; // sum of both
  };
  std::vector<double> best(lights, -1); // correlations
  for (size_t l = 0; l < lights; ++l)
    for (size_t k = 0; k < lights; ++k)
      best[l] = std::max(best[l], evidence.correlation(l, k, fewest).value_or(-1));
  const auto isNearBest = [&](size_t l, size_t k) {
    return evidence.correlation(l, k, fewest).value_or(-1) > best[l] - kNearBest;
  };
  std::vector<Pair> candidates;
  for (size_t a = 0; a < lights; ++a)
    for (size_t b = a + 1; b < lights; ++b) {
      const auto ofA = evidence.gain(a, b, fewest), ofB = evidence.gain(b, a, fewest);
      if (ofA && ofB && std::min(*ofA, *ofB) > 0 && *ofA + *ofB > 2 * kLikelierLight && isNearBest(a, b) &&
          isNearBest(b, a))
        candidates.push_back({a, b, *ofA + *ofB});
    }
  std::ranges::stable_sort(candidates, std::ranges::greater(), &Pair::gain);
  std::vector<bool> isTaken(lights);
  std::vector<std::pair<size_t, size_t>> pairs;
  for (const Pair& pair : candidates) {
    if (isTaken[pair.a] || isTaken[pair.b]) continue;
    isTaken[pair.a] = isTaken[pair.b] = true;
    pairs.emplace_back(pair.a, pair.b);
  }
  return pairs;
}

} // namespace surflect::validation
