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
constexpr size_t kIterations = 60, kFurtherIterations = 20; // of fits from nothing, and from a table
constexpr size_t kFibrePhotographs = 50'000;                // in all patches of a cluster

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
  fit.mostIterations = kFurtherIterations;
  const std::vector<Fibre> fibres =
      refinedFibres(kFibreGrid, ofFew.view(), fewFrames, patches,
                    highlightFibres(ofFew.view(), fewFrames, patches, options.white), fit, 2, progress);
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

// Mixes errors and gains of surfels (`tables` of each) with those of the nearest surfels whose own share
// is 1. ownShare: part that a surfel's own photographs decide, 0..1 (#surfels).
void completeFromNearest(std::span<const Point3<AcquisitionSpace>> places, std::span<const float> ownShare,
                         size_t tables, std::span<float> errors, std::span<Rgb> gains) {
  constexpr size_t kNearest = 8;
  std::vector<uint32_t> whole;
  std::vector<Point3<AcquisitionSpace>> wholePlaces;
  for (uint32_t s = 0; s < ownShare.size(); ++s)
    if (ownShare[s] >= 1) {
      whole.push_back(s);
      wholePlaces.push_back(places[s]);
    }
  if (whole.empty()) return;
  const NeighborIndex index(wholePlaces);
  tbb::parallel_for(size_t{0}, ownShare.size(), [&](size_t s) {
    if (ownShare[s] >= 1) return;
    const auto near = index.nearest(places[s], kNearest);
    const float share = (1 - ownShare[s]) / static_cast<float>(near.size());
    for (size_t i = s * tables; i < (s + 1) * tables; ++i) {
      errors[i] *= ownShare[s];
      gains[i] = ownShare[s] * gains[i];
      for (const auto& [neighbor, distance] : near) {
        const size_t other = whole[neighbor] * tables + i - s * tables;
        errors[i] += share * errors[other];
        gains[i] = gains[i] + share * gains[other];
      }
    }
  });
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

// Fits tables to photographs in frames that are turned to the fibres.
class TableFits {
public:
  // The arguments must outlive this.
  TableFits(const Photographs& photographs, std::span<const Angle> fibres, const SharingOptions& options,
            const Progress& progress)
      : directions_(turnedDirections(photographs, fibres)), along_(photographs), options_(options),
        places_(placesOf(options.grid, directions_)), progress_(progress) {
    along_.directions = directions_;
  }

  // A table of the members, from about `most` photographs; better than `start`, if that is a table.
  SharedTable fitted(std::vector<float> membership, size_t most, SharedTable start = {}) const {
    FitOptions fit;
    fit.white = options_.white;
    fit.mostIterations = start.nodes.empty() ? kIterations : kFurtherIterations;
    return fitSharedTable(options_.grid, along_, places_,
                          thinnedMembership(along_, std::move(membership), most), fit, 2, progress_,
                          std::move(start));
  }

  // Sets tables and gains by the mixtures, each table better than that of `start`, if there are any.
  void fitAll(SharedReflectance& shared, size_t most, std::vector<SharedTable> start) const {
    const size_t count = shared.trust.size();
    start.resize(count);
    shared.tables = {options_.grid, {}};
    std::vector<std::vector<Rgb>> predictions;
    for (size_t table = 0; table < count; ++table) {
      std::vector<float> membership;
      for (const TableMixture& mixture : shared.mixtures) membership.push_back(weightIn(mixture, table));
      SharedTable own = fitted(std::move(membership), most, std::move(start[table]));
      shared.tables.add(own.nodes);
      predictions.push_back(std::move(own.predictions));
    }
    shared.gains = gainsOf(along_, mixedPredictions(predictions, along_, shared.mixtures), options_.white);
  }

private:
  const std::vector<HalfDifference<>> directions_;
  Photographs along_;
  const SharingOptions& options_;
  const std::vector<TablePlace> places_;
  const Progress& progress_;
};

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

  TableFits fits(photographs, shared.fibres, options, progress);
  std::vector<SharedTable> tables;
  std::vector<float> errors(surfels * clusters.count);
  for (uint32_t cluster = 0; cluster < clusters.count; ++cluster) {
    tables.push_back(fits.fitted(membershipIn(clusters.of, cluster), options.photographs / 4));
    const auto ofTable = leftOutErrors(photographs, tables.back().predictions, options.white);
    for (size_t s = 0; s < surfels; ++s) errors[s * clusters.count + cluster] = ofTable[s];
  }
  errors = smoothedErrors(places, errors);
  for (size_t s = 0; s < surfels; ++s)
    shared.mixtures.push_back(mixtureOf(std::span(errors).subspan(s * clusters.count, clusters.count)));

  fits.fitAll(shared, options.photographs, std::move(tables));
  return shared;
}

SharedReflectance refitReflectance(const SharedReflectance& shared, const Photographs& photographs,
                                   const SharingOptions& options, const Progress& progress) {
  assert(photographs.surfels() == shared.mixtures.size());
  SharedReflectance refitted = shared;
  TableFits(photographs, shared.fibres, options, progress).fitAll(refitted, options.photographs / 4, {});
  return refitted;
}

SharedReflectance spreadReflectance(const SharedReflectance& sample, const SurfelPlaces& sampled,
                                    const SurfelPlaces& surfels, const PhotographsOf& photographsOf,
                                    const Progress& progress) {
  const size_t count = surfels.size(), tables = sample.tables.count();
  SharedReflectance all{
      sample.white, sample.tables, sample.trust, fibresNear(sample, sampled, surfels), {}, {}};
  std::vector<float> errors(count * tables);
  std::vector<Rgb> gains(count * tables); // by each table alone
  std::vector<float> ownShare(count);     // min(1, photographs / kEnough)
  for (size_t begin = 0; begin < count; begin += kSurfelsAtOnce) {
    progress.checkpoint();
    const size_t end = std::min(count, begin + kSurfelsAtOnce);
    const PhotographArrays own = photographsOf(begin, end);
    const std::vector<HalfDifference<>> directions =
        turnedDirections(own.view(), std::span(all.fibres).subspan(begin, end - begin));
    Photographs along = own.view();
    along.directions = directions;
    const std::vector<TablePlace> places = placesOf(sample.tables.grid, directions);
    for (size_t s = begin; s < end; ++s)
      ownShare[s] =
          std::min(1.f, static_cast<float>(along.first[s - begin + 1] - along.first[s - begin]) / kEnough);
    for (size_t table = 0; table < tables; ++table) {
      const auto predictions = predictionsOf(sample.tables.grid, sample.tables.nodes(table), along, places);
      const std::vector<float> ownErrors = leftOutErrors(along, predictions, sample.white);
      const std::vector<Rgb> ownGains = gainsOf(along, predictions, sample.white);
      for (size_t s = begin; s < end; ++s) {
        errors[s * tables + table] = ownErrors[s - begin];
        gains[s * tables + table] = ownGains[s - begin];
      }
    }
  }
  completeFromNearest(surfels.places, ownShare, tables, errors, gains);
  errors = smoothedErrors(surfels.places, errors);
  for (size_t s = 0; s < count; ++s) {
    const TableMixture mixture = mixtureOf(std::span(errors).subspan(s * tables, tables));
    Rgb gain;
    for (size_t m = 0; m < kMixedTables; ++m)
      gain = gain + mixture.weight[m] * gains[s * tables + mixture.table[m]];
    all.mixtures.push_back(mixture);
    all.gains.push_back(gain);
  }
  return all;
}

} // namespace surflect::reflectance
