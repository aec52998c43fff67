#include "srf/reflectance/shared_reflectance.h"

#include "srf/reflectance/clusters.h"
#include "srf/reflectance/gains.h"
#include "srf/reflectance/shared_table.h"
#include "surfel/geometry/neighbors.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <limits>

namespace surflect::reflectance {

namespace {

constexpr TableGrid kFibreGrid{{25, 25, 3, 3}};
constexpr size_t kFibrePhotographs = 100'000; // in all patches of a cluster

template <class T> std::vector<T> chosen(std::span<const T> all, std::span<const uint32_t> indices) {
  std::vector<T> some;
  for (const uint32_t index : indices) some.push_back(all[index]);
  return some;
}

// Fibres of the members of a cluster, in the members' order.
std::vector<Angle> fibresOf(const Photographs& photographs, std::span<const Point3<AcquisitionSpace>> places,
                            std::span<const SurfelFrame> frames, const SharingOptions& options,
                            const Progress& progress) {
  const std::vector<uint32_t> few = thinnedSurfels(photographs, kFibrePhotographs);
  const auto fewFrames = chosen(frames, std::span<const uint32_t>(few));
  const auto fewPlaces = chosen(places, std::span<const uint32_t>(few));
  const PhotographArrays ofFew = subsetOf(photographs, few);
  Patches patches =
      patchesOf(fewPlaces, std::max<size_t>(1, ofFew.reflectance.size() /
                                                   std::max<size_t>(1, options.photographsInPatch)));
  FitOptions fit;
  fit.white = options.white;
  fit.mostIterations = 40;
  const std::vector<Fibre> fibres =
      refinedFibres(kFibreGrid, ofFew.view(), fewFrames, patches,
                    highlightFibres(ofFew.view(), fewFrames, patches, options.white), fit, 3, progress);
  for (uint32_t& centre : patches.centres) centre = few[centre];
  return fibreAngles(places, frames, patches, fibres);
}

// Memberships of surfels in one table, 0 for those that are left out so that about `most` photographs remain.
std::vector<float> thinnedMembership(const Photographs& photographs, std::vector<float> membership,
                                     size_t most) {
  size_t ofMembers = 0; // photographs
  for (size_t s = 0; s < membership.size(); ++s)
    if (membership[s] > 0) ofMembers += photographs.first[s + 1] - photographs.first[s];
  const size_t step = std::max<size_t>(1, (ofMembers + most - 1) / most);
  size_t rank = 0;
  for (float& weight : membership)
    if (weight > 0 && rank++ % step != 0) weight = 0;
  return membership;
}

float weightIn(const TableMixture& mixture, size_t table) {
  float sum = 0;
  for (size_t m = 0; m < kMixedTables; ++m)
    if (mixture.table[m] == table) sum += mixture.weight[m];
  return sum;
}

// Directions of photographs in frames that are turned to the fibres of their surfels.
std::vector<HalfDifference<>> turnedDirections(const Photographs& photographs,
                                               std::span<const Angle> fibres) {
  std::vector<HalfDifference<>> directions(photographs.size());
  tbb::parallel_for(size_t{0}, photographs.surfels(), [&](size_t s) {
    for (size_t i = photographs.first[s]; i < photographs.first[s + 1]; ++i)
      directions[i] = turned(photographs.directions[i], fibres[s]);
  });
  return directions;
}

// Fibres of surfels: the mean line of the nearest sampled surfels, weighted by a nearness that falls to 0
// where another one becomes nearer.
std::vector<Angle> fibresNear(const SharedReflectance& sample, const SurfelPlaces& sampled,
                              const SurfelPlaces& surfels) {
  constexpr size_t kBlended = 6;
  const NeighborIndex index(sampled.places);
  std::vector<Angle> fibres(surfels.size());
  tbb::parallel_for(size_t{0}, surfels.size(), [&](size_t s) {
    const auto near = index.nearest(surfels.places[s], kBlended + 1);
    const float end = near.size() > kBlended ? near.back().distance : std::numeric_limits<float>::infinity();
    std::vector<Angle> lines;
    std::vector<float> weights;
    for (const auto& [neighbor, distance] : near) {
      const Angle carried = carriedAngle(sampled.frames[neighbor], surfels.frames[s]);
      lines.push_back(Angle::fromRadians(carried.radians() + sample.fibres[neighbor].radians()));
      weights.push_back(end > 0 ? std::max(0.f, 1 - distance / end) : 1);
    }
    fibres[s] = meanLine(lines, weights);
  });
  return fibres;
}

// Predictions of all photographs by the mixtures of their surfels.
std::vector<Rgb> mixedPredictions(const std::vector<std::vector<Rgb>>& ofTables,
                                  const Photographs& photographs, std::span<const TableMixture> mixtures) {
  std::vector<Rgb> mixed(photographs.size());
  tbb::parallel_for(size_t{0}, photographs.surfels(), [&](size_t s) {
    for (size_t m = 0; m < kMixedTables; ++m)
      for (size_t i = photographs.first[s]; i < photographs.first[s + 1]; ++i)
        mixed[i] = mixed[i] + mixtures[s].weight[m] * ofTables[mixtures[s].table[m]][i];
  });
  return mixed;
}

} // namespace

SharedReflectance shareReflectance(const Photographs& photographs, const SurfelPlaces& sampled,
                                   const SharingOptions& options, const Progress& progress) {
  const size_t surfels = photographs.surfels();
  const auto& [places, frames] = sampled;
  assert(places.size() == surfels && frames.size() == surfels);
  const Clusters clusters =
      findClusters(photographs, {.white = options.white, .mostClusters = options.mostTables}, progress);

  SharedReflectance shared{options.white,
                           {options.grid, {}},
                           std::vector<float>(clusters.count, 1.f),
                           std::vector<Angle>(surfels),
                           {},
                           {}};
  for (uint32_t cluster = 0; cluster < clusters.count; ++cluster) {
    std::vector<uint32_t> members;
    for (uint32_t s = 0; s < surfels; ++s)
      if (clusters.of[s] == cluster) members.push_back(s);
    const PhotographArrays ofMembers = subsetOf(photographs, members);
    const std::span<const uint32_t> indices = members;
    const std::vector<Angle> fibres =
        fibresOf(ofMembers.view(), chosen(places, indices), chosen(frames, indices), options, progress);
    for (size_t i = 0; i < members.size(); ++i) shared.fibres[members[i]] = fibres[i];
  }

  const std::vector<HalfDifference<>> directions = turnedDirections(photographs, shared.fibres);
  Photographs along = photographs;
  along.directions = directions;
  const std::vector<TablePlace> gridPlaces = placesOf(options.grid, directions);
  FitOptions fit;
  fit.white = options.white;
  const auto fitted = [&](std::vector<float> membership, size_t rounds) {
    return fitSharedTable(options.grid, along, gridPlaces,
                          thinnedMembership(along, std::move(membership), options.photographs), fit, rounds,
                          progress);
  };

  std::vector<float> errors(surfels * clusters.count);
  for (uint32_t cluster = 0; cluster < clusters.count; ++cluster) {
    const SharedTable table = fitted(membershipIn(clusters.of, cluster), 2);
    const auto ofTable = leftOutErrors(along, table.predictions, options.white);
    for (size_t s = 0; s < surfels; ++s) errors[s * clusters.count + cluster] = ofTable[s];
  }
  errors = smoothedErrors(places, errors);
  for (size_t s = 0; s < surfels; ++s)
    shared.mixtures.push_back(mixtureOf(std::span(errors).subspan(s * clusters.count, clusters.count)));

  std::vector<std::vector<Rgb>> predictions;
  for (uint32_t cluster = 0; cluster < clusters.count; ++cluster) {
    std::vector<float> membership;
    for (const TableMixture& mixture : shared.mixtures) membership.push_back(weightIn(mixture, cluster));
    SharedTable table = fitted(std::move(membership), 3);
    shared.tables.add(table.nodes);
    predictions.push_back(std::move(table.predictions));
  }
  shared.gains = gainsOf(along, mixedPredictions(predictions, along, shared.mixtures), options.white);
  return shared;
}

SharedReflectance spreadReflectance(const SharedReflectance& sample, const SurfelPlaces& sampled,
                                    const SurfelPlaces& surfels, const PhotographsOf& photographsOf,
                                    const Progress& progress) {
  const size_t count = surfels.size(), tables = sample.tables.count();
  SharedReflectance all{
      sample.white, sample.tables, sample.trust, fibresNear(sample, sampled, surfels), {}, {}};
  std::vector<std::vector<Rgb>> nodes;
  for (size_t table = 0; table < tables; ++table) nodes.push_back(sample.tables.nodes(table));

  // Calls use(first surfel, photographs along the fibres, predictions of each table), part by part.
  const auto forEachPart = [&](const auto& use) {
    for (size_t begin = 0; begin < count; begin += kSurfelsAtOnce) {
      progress.checkpoint();
      const size_t end = std::min(count, begin + kSurfelsAtOnce);
      const PhotographArrays own = photographsOf(begin, end);
      const Photographs photographs = own.view();
      const std::vector<HalfDifference<>> directions =
          turnedDirections(photographs, std::span(all.fibres).subspan(begin, end - begin));
      Photographs along = photographs;
      along.directions = directions;
      const std::vector<TablePlace> places = placesOf(sample.tables.grid, directions);
      std::vector<std::vector<Rgb>> predictions;
      for (const auto& ofTable : nodes)
        predictions.push_back(predictionsOf(sample.tables.grid, ofTable, along, places));
      use(begin, along, predictions);
    }
  };

  std::vector<float> errors(count * tables);
  forEachPart([&](size_t begin, const Photographs& photographs, const auto& predictions) {
    for (size_t table = 0; table < tables; ++table) {
      const std::vector<float> ofTable = leftOutErrors(photographs, predictions[table], sample.white);
      for (size_t s = 0; s < ofTable.size(); ++s) errors[(begin + s) * tables + table] = ofTable[s];
    }
  });
  errors = smoothedErrors(surfels.places, errors);
  for (size_t s = 0; s < count; ++s)
    all.mixtures.push_back(mixtureOf(std::span(errors).subspan(s * tables, tables)));
  forEachPart([&](size_t begin, const Photographs& photographs, const auto& predictions) {
    const auto mixtures = std::span(all.mixtures).subspan(begin, photographs.surfels());
    const std::vector<Rgb> gains =
        gainsOf(photographs, mixedPredictions(predictions, photographs, mixtures), sample.white);
    all.gains.insert(all.gains.end(), gains.begin(), gains.end());
  });
  return all;
}

} // namespace surflect::reflectance
