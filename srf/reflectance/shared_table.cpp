#include "srf/reflectance/shared_table.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>

namespace surflect::reflectance {

namespace {

constexpr size_t kPhotographsAtOnce = 1 << 12;

template <class Use> void forEachPhotograph(size_t count, const Use& use) {
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kPhotographsAtOnce), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) use(i);
  });
}

// 1 / (white^2 + max(y)^2)
float brightnessWeight(const Rgb& y, float white) {
  const float most = std::max({y.r, y.g, y.b});
  return 1 / (white * white + most * most);
}

// r of one channel.
float robustWeight(float measured, float predicted, float white) {
  const float share = 2 * (measured - predicted) / (0.1f * white + predicted);
  return 1 / (1 + share * share);
}
float robustWeight(const Rgb& measured, const Rgb& predicted, float white) {
  return std::min({robustWeight(measured.r, predicted.r, white), robustWeight(measured.g, predicted.g, white),
                   robustWeight(measured.b, predicted.b, white)});
}

// Photographs of members, as the fit needs them.
struct MemberSamples {
  std::vector<TablePlace> places;
  std::vector<Rgb> measured, factors;
  std::vector<float> weights;
};

} // namespace

std::vector<TablePlace> placesOf(const TableGrid& grid, std::span<const HalfDifference<>> directions) {
  std::vector<TablePlace> places(directions.size());
  forEachPhotograph(places.size(), [&](size_t i) { places[i] = placeOf(grid, directions[i]); });
  return places;
}

std::vector<Rgb> predictionsOf(const TableGrid& grid, std::span<const Rgb> nodes,
                               const Photographs& photographs, std::span<const TablePlace> places) {
  std::vector<Rgb> predictions(photographs.size());
  forEachPhotograph(predictions.size(), [&](size_t i) {
    predictions[i] = photographs.links[i] * positive(lookUpNodes(grid, nodes, places[i]));
  });
  return predictions;
}

SharedTable fitSharedTable(const TableGrid& grid, const Photographs& photographs,
                           std::span<const TablePlace> places, std::span<const float> membership,
                           const FitOptions& options, size_t rounds, const Progress& progress,
                           SharedTable shared) {
  assert(places.size() == photographs.size() && membership.size() == photographs.surfels());
  if (shared.nodes.empty()) shared.gains.assign(photographs.surfels(), {1, 1, 1});
  for (size_t round = 0; round < rounds; ++round) {
    MemberSamples samples;
    for (size_t surfel = 0; surfel < photographs.surfels(); ++surfel) {
      if (membership[surfel] <= 0) continue;
      const Rgb& gain = shared.gains[surfel];
      for (size_t i = photographs.first[surfel]; i < photographs.first[surfel + 1]; ++i) {
        const Rgb& y = photographs.reflectance[i];
        samples.places.push_back(places[i]);
        samples.measured.push_back(y);
        samples.factors.push_back(photographs.links[i] * gain);
        samples.weights.push_back(
            membership[surfel] * brightnessWeight(y, options.white) *
            (shared.nodes.empty() ? 1 : robustWeight(y, gain * shared.predictions[i], options.white)));
      }
    }
    shared.nodes = fitTable(grid, {samples.places, samples.measured, samples.factors, samples.weights},
                            options, shared.nodes, progress);
    shared.predictions = predictionsOf(grid, shared.nodes, photographs, places);
    shared.gains = gainsOf(photographs, shared.predictions, options.white);
  }
  return shared;
}

} // namespace surflect::reflectance
