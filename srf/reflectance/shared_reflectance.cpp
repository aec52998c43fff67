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
constexpr size_t kTiltPhotographs = 150;                    // in each patch

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

// Photographs with directions in the frames of the tables.
class TurnedPhotographs {
public:
  // The photographs must outlive this. One tilt and fibre each a surfel.
  TurnedPhotographs(const Photographs& photographs, std::span<const Tilt> tilts,
                    std::span<const Angle> fibres)
      : turned_(photographs), directions_(photographs.size()), links_(photographs.size()) {
    tbb::parallel_for(size_t{0}, photographs.surfels(), [&](size_t s) {
      const Mat3<float> inTilted = tiltRotation(tilts[s]).transpose();
      for (size_t i = photographs.first[s]; i < photographs.first[s + 1]; ++i) {
        const auto view = rotated(inTilted, photographs.towardsView[i]);
        const auto light = rotated(inTilted, photographs.towardsLight[i]);
        directions_[i] = turned(halfDifference(view, light), fibres[s]);
        links_[i] = tableLink(light.z(), view.z());
      }
    });
    turned_.directions = directions_;
    turned_.links = links_;
  }

  const Photographs& view() const { return turned_; }

private:
  Photographs turned_;
  std::vector<HalfDifference<>> directions_;
  std::vector<float> links_;
};

// Fibres of surfels: the mean line of the nearest sampled surfels, weighted by a nearness that falls to 0
// where another one becomes nearer.
std::vector<Angle> fibresNear(const SharedReflectance& sample, const SurfelPlaces& sampled,
                              const SurfelPlaces& surfels) {
  constexpr size_t kBlended = 6;
  const NeighborIndex index(sampled.places);
  std::vector<Angle> fibres(surfels.size());
  tbb::parallel_for(size_t{0}, surfels.size(), [&](size_t s) {
    std::vector<Angle> lines;
    std::vector<float> weights;
    for (const auto& [neighbor, weight] : index.blended(surfels.places[s], kBlended)) {
      const Angle carried = carriedAngle(sampled.frames[neighbor], surfels.frames[s]);
      lines.push_back(Angle::fromRadians(carried.radians() + sample.fibres[neighbor].radians()));
      weights.push_back(weight);
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
  TableFits(const Photographs& photographs, const SharedReflectance& frames, const SharingOptions& options,
            const Progress& progress)
      : turned_(photographs, frames.tilts, frames.fibres), along_(turned_.view()), options_(options),
        places_(placesOf(options.grid, along_.directions)), progress_(progress) {}

  // A table of the members, from about `most` photographs; better than `start`, if that is a table.
  SharedTable fitted(std::vector<float> membership, size_t most, SharedTable start = {}) const {
    FitOptions fit;
    fit.white = options_.white;
    fit.mostIterations = start.nodes.empty() ? kIterations : kFurtherIterations;
    return fitSharedTable(options_.grid, along_, places_,
                          thinnedMembership(along_, std::move(membership), most), fit, 2, progress_,
                          std::move(start));
  }

  // Tables and gains to begin with.
  std::vector<SharedTable> startFrom(const SharedReflectance& shared) const {
    std::vector<SharedTable> tables;
    for (size_t table = 0; table < shared.tables.count(); ++table) {
      SharedTable start{shared.tables.nodes(table), shared.gains, {}};
      start.predictions = predictionsOf(options_.grid, start.nodes, along_, places_);
      tables.push_back(std::move(start));
    }
    return tables;
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
  const TurnedPhotographs turned_;
  const Photographs& along_;
  const SharingOptions& options_;
  const std::vector<TablePlace> places_;
  const Progress& progress_;
};

// Tilts normals to where the tables predict the photographs best, and fits the tables anew, in two rounds.
// Keeps both as they are unless tilts save kLeastSaved of the error of photographs that did not choose them.
void tiltNormals(SharedReflectance& shared, const Photographs& photographs, const SurfelPlaces& surfels,
                 const SharingOptions& options, const Progress& progress) {
  constexpr double kLeastSaved = 0.05;
  constexpr size_t kTried = 8; // every such patch
  const Patches patches =
      patchesOf(surfels.places, std::max<size_t>(1, photographs.size() / kTiltPhotographs));
  const std::span<const uint32_t> centres = patches.centres;
  const auto places = chosen(surfels.places, centres);
  const auto frames = chosen(surfels.frames, centres);
  const auto tables = [&]() -> TiltedTables {
    return {shared.tables, shared.mixtures, shared.gains, shared.fibres, options.white};
  };
  if (savedByTilts(tables(), photographs, surfels.frames, patches, kTried, progress) < kLeastSaved) return;
  for (int round = 0; round < 2; ++round) {
    const std::vector<Tilt> tilts = seekTilts(tables(), photographs, surfels.frames, patches, progress);
    shared.tilts = tiltsNear(places, frames, tilts, surfels.places, surfels.frames);
    const TableFits fits(photographs, shared, options, progress);
    fits.fitAll(shared, options.photographs, fits.startFrom(shared));
  }
}

} // namespace

SharedReflectance shareReflectance(const Photographs& photographs, const SurfelPlaces& sampled,
                                   const SharingOptions& options, const Progress& progress) {
  const size_t surfels = photographs.surfels();
  const auto& [places, frames] = sampled;
  assert(places.size() == surfels && frames.size() == surfels);
  progress("tables", 0);
  const Clusters clusters =
      findClusters(photographs, {.white = options.white, .mostClusters = options.mostTables}, progress);

  SharedReflectance shared{options.white,
                           {options.grid, {}},
                           std::vector<float>(clusters.count, 1.f),
                           std::vector<Tilt>(surfels),
                           std::vector<Angle>(surfels),
                           {},
                           {}};
  // Clusters, fibres and tables take about a third each.
  const auto afterClusters = [&](double thirds, uint32_t cluster) {
    progress("tables", (thirds + static_cast<double>(cluster) / static_cast<double>(clusters.count)) / 3);
  };
  for (uint32_t cluster = 0; cluster < clusters.count; ++cluster) {
    afterClusters(1, cluster);
    std::vector<uint32_t> members;
    for (uint32_t s = 0; s < surfels; ++s)
      if (clusters.of[s] == cluster) members.push_back(s);
    const PhotographArrays ofMembers = subsetOf(photographs, members);
    const std::span<const uint32_t> indices = members;
    const std::vector<Angle> fibres =
        fibresOf(ofMembers.view(), chosen(places, indices), chosen(frames, indices), options, progress);
    for (size_t i = 0; i < members.size(); ++i) shared.fibres[members[i]] = fibres[i];
  }

  const TableFits fits(photographs, shared, options, progress);
  std::vector<SharedTable> tables;
  std::vector<float> errors(surfels * clusters.count);
  for (uint32_t cluster = 0; cluster < clusters.count; ++cluster) {
    afterClusters(2, cluster);
    tables.push_back(fits.fitted(membershipIn(clusters.of, cluster), options.photographs / 4));
    const auto ofTable = leftOutErrors(photographs, tables.back().predictions, options.white);
    for (size_t s = 0; s < surfels; ++s) errors[s * clusters.count + cluster] = ofTable[s];
  }
  errors = smoothedErrors(places, errors);
  for (size_t s = 0; s < surfels; ++s)
    shared.mixtures.push_back(mixtureOf(std::span(errors).subspan(s * clusters.count, clusters.count)));

  fits.fitAll(shared, options.photographs, std::move(tables));
  tiltNormals(shared, photographs, sampled, options, progress);
  return shared;
}

SharedReflectance refitReflectance(const SharedReflectance& shared, const Photographs& photographs,
                                   const SharingOptions& options, const Progress& progress) {
  assert(photographs.surfels() == shared.mixtures.size());
  SharedReflectance refitted = shared;
  TableFits(photographs, shared, options, progress).fitAll(refitted, options.photographs / 4, {});
  return refitted;
}

SharedReflectance spreadReflectance(const SharedReflectance& sample, const SurfelPlaces& sampled,
                                    const SurfelPlaces& surfels, const PhotographsOf& photographsOf,
                                    const Progress& progress) {
  const size_t count = surfels.size(), tables = sample.tables.count();
  SharedReflectance all{
      sample.white,
      sample.tables,
      sample.trust,
      tiltsNear(sampled.places, sampled.frames, sample.tilts, surfels.places, surfels.frames),
      fibresNear(sample, sampled, surfels),
      {},
      {}};
  std::vector<float> errors(count * tables);
  std::vector<Rgb> gains(count * tables); // by each table alone
  std::vector<float> ownShare(count);     // min(1, photographs / kEnough)
  for (size_t begin = 0; begin < count; begin += kSurfelsAtOnce) {
    progress("tables of all surfels", static_cast<double>(begin) / static_cast<double>(count));
    const size_t end = std::min(count, begin + kSurfelsAtOnce);
    const PhotographArrays own = photographsOf(begin, end);
    const TurnedPhotographs turned(own.view(), std::span(all.tilts).subspan(begin, end - begin),
                                   std::span(all.fibres).subspan(begin, end - begin));
    const Photographs& along = turned.view();
    const std::vector<TablePlace> places = placesOf(sample.tables.grid, along.directions);
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
