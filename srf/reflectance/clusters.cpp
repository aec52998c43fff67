#include "srf/reflectance/clusters.h"

#include "srf/reflectance/gains.h"
#include "srf/reflectance/shared_table.h"
#include "srf/reflectance/table_fit.h"
#include "surfel/geometry/neighbors.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <random>

namespace surflect::reflectance {

namespace {

constexpr size_t kRings = kRingEdges.size() + 1;
constexpr TableGrid kIsotropicGrid{{33, 1, 7, 1}};

float squaredDistance(const RingProfile& a, const RingProfile& b) {
  float sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

// Index of the centre nearest to a profile.
uint32_t nearestOf(std::span<const RingProfile> centres, const RingProfile& profile) {
  uint32_t nearest = 0;
  float least = std::numeric_limits<float>::infinity();
  for (uint32_t c = 0; c < centres.size(); ++c)
    if (const float distance = squaredDistance(centres[c], profile); distance < least) {
      least = distance;
      nearest = c;
    }
  return nearest;
}

// Profiles drawn one after another, each with a chance proportional to its squared distance from those before
// it [Arthur 2007].
std::vector<RingProfile> seedsOf(std::span<const RingProfile> profiles, size_t k) {
  std::mt19937 random(1);
  std::vector<RingProfile> seeds{profiles[random() % profiles.size()]};
  while (seeds.size() < k) {
    std::vector<double> sums;
    double sum = 0;
    for (const RingProfile& profile : profiles)
      sums.push_back(sum += squaredDistance(seeds[nearestOf(seeds, profile)], profile));
    if (sum <= 0) break; // fewer different profiles than k
    const double drawn = sum * (static_cast<double>(random()) / 4294967296.0);
    const auto at = static_cast<size_t>(std::ranges::upper_bound(sums, drawn) - sums.begin());
    seeds.push_back(profiles[std::min(at, profiles.size() - 1)]);
  }
  return seeds;
}

// Photographs number which, which + 2, .. of each surfel; which is 0 or 1.
PhotographArrays everyOther(const Photographs& photographs, size_t which) {
  PhotographArrays some;
  for (size_t s = 0; s < photographs.surfels(); ++s) {
    for (size_t i = photographs.first[s] + which; i < photographs.first[s + 1]; i += 2)
      some.add(photographs.towardsView[i], photographs.towardsLight[i], photographs.reflectance[i]);
    some.endSurfel();
  }
  return some;
}

std::vector<TablePlace> isotropicPlaces(const Photographs& photographs) {
  std::vector<HalfDifference<>> directions;
  for (const HalfDifference<>& at : photographs.directions) directions.push_back(withoutAngles(at));
  return placesOf(kIsotropicGrid, directions);
}

// Isotropic tables of clusters, and the errors of predictions by them.
class IsotropicTables {
public:
  IsotropicTables(const Photographs& photographs, const ClusterOptions& options, const Progress& progress)
      : photographs_(photographs), places_(isotropicPlaces(photographs)), progress_(progress) {
    fit_.white = options.white;
  }

  std::vector<Rgb> fitted(std::span<const float> membership) const {
    return fitSharedTable(kIsotropicGrid, photographs_, places_, membership, fit_, 2, progress_).nodes;
  }

  std::vector<float> errors(std::span<const Rgb> nodes) const {
    return leftOutErrors(photographs_, predictionsOf(kIsotropicGrid, nodes, photographs_, places_),
                         fit_.white);
  }

private:
  const Photographs photographs_;
  const std::vector<TablePlace> places_;
  const Progress& progress_;
  FitOptions fit_;
};

// Sum of errors over the photographs of the surfels of some clusters, each predicted by a table that was
// fitted to the other half of these surfels. Errors that are too small to be seen count as kUnseen a
// photograph.
class CrossErrors {
public:
  CrossErrors(const Photographs& photographs, const ClusterOptions& options, const Progress& progress)
      : photographs_(photographs), options_(options), progress_(progress) {}

  double of(std::span<const uint32_t> cluster, std::initializer_list<uint32_t> chosen) const {
    std::array<std::vector<uint32_t>, 2> halves;
    size_t members = 0;
    for (uint32_t s = 0; s < cluster.size(); ++s)
      if (std::ranges::find(chosen, cluster[s]) != chosen.end()) halves[members++ % 2].push_back(s);
    return errorOf(halves[0], halves[1]) + errorOf(halves[1], halves[0]);
  }

private:
  double errorOf(std::span<const uint32_t> test, std::span<const uint32_t> training) const {
    constexpr double kUnseen = 1e-3;
    const PhotographArrays ofTest = subsetOf(photographs_, test),
                           ofTraining = subsetOf(photographs_, training);
    const Photographs given = ofTest.view();
    const std::vector<Rgb> nodes = IsotropicTables(ofTraining.view(), options_, progress_)
                                       .fitted(std::vector<float>(training.size(), 1.f));
    const std::vector<float> errors = IsotropicTables(given, options_, progress_).errors(nodes);
    double sum = 0;
    for (size_t s = 0; s < errors.size(); ++s)
      sum += double{errors[s]} * (given.first[s + 1] - given.first[s]);
    return std::max(sum, kUnseen * static_cast<double>(given.size()));
  }

  const Photographs photographs_;
  const ClusterOptions& options_;
  const Progress& progress_;
};

std::vector<std::vector<Rgb>> tablesOf(const IsotropicTables& tables, std::span<const uint32_t> cluster,
                                       size_t count) {
  std::vector<std::vector<Rgb>> all;
  for (uint32_t c = 0; c < count; ++c) all.push_back(tables.fitted(membershipIn(cluster, c)));
  return all;
}

// Errors of surfels by tables, [surfel][table].
std::vector<float> errorsOf(const IsotropicTables& tables, std::span<const std::vector<Rgb>> nodes,
                            size_t surfels) {
  std::vector<float> errors(surfels * nodes.size());
  for (size_t c = 0; c < nodes.size(); ++c) {
    const std::vector<float> ofTable = tables.errors(nodes[c]);
    for (size_t s = 0; s < surfels; ++s) errors[s * nodes.size() + c] = ofTable[s];
  }
  return errors;
}

std::vector<uint32_t> leastOf(std::span<const float> errors, size_t count) {
  std::vector<uint32_t> least;
  for (size_t begin = 0; begin < errors.size(); begin += count) {
    const auto row = errors.subspan(begin, count);
    least.push_back(static_cast<uint32_t>(std::ranges::min_element(row) - row.begin()));
  }
  return least;
}

// Clusters that have surfels, in rising order.
std::vector<uint32_t> numbersOf(std::vector<uint32_t> cluster) {
  std::ranges::sort(cluster);
  cluster.erase(std::unique(cluster.begin(), cluster.end()), cluster.end());
  return cluster;
}

// Renumbers clusters 0, 1, ... without gaps; returns their number.
size_t renumber(std::vector<uint32_t>& cluster) {
  const std::vector<uint32_t> numbers = numbersOf(cluster);
  for (uint32_t& c : cluster)
    c = static_cast<uint32_t>(std::ranges::lower_bound(numbers, c) - numbers.begin());
  return numbers.size();
}

// Merges the two clusters whose union costs least, as a part of the error of the two, while that is at most
// `tolerance`.
void merge(const CrossErrors& errors, std::vector<uint32_t>& cluster, double tolerance) {
  const size_t count = renumber(cluster);
  std::vector<double> alone(count);
  for (uint32_t c = 0; c < count; ++c) alone[c] = errors.of(cluster, {c});
  struct Union {
    uint32_t first, second; // clusters; first < second
    double error;
  };
  std::vector<Union> unions;
  const auto addUnion = [&](uint32_t a, uint32_t b) {
    unions.push_back({std::min(a, b), std::max(a, b), errors.of(cluster, {a, b})});
  };
  for (uint32_t a = 0; a < count; ++a)
    for (uint32_t b = a + 1; b < count; ++b) addUnion(a, b);
  const auto costOf = [&](const Union& each) { // 0 where no photograph is left to tell them apart
    const double apart = alone[each.first] + alone[each.second];
    return apart > 0 ? each.error / apart - 1 : 0;
  };
  while (!unions.empty()) {
    const Union best = *std::ranges::min_element(unions, {}, costOf);
    if (costOf(best) > tolerance) return;
    std::ranges::replace(cluster, best.second, best.first);
    alone[best.first] = best.error;
    std::erase_if(unions, [&](const Union& each) {
      return each.first == best.first || each.second == best.first || each.first == best.second ||
             each.second == best.second;
    });
    for (const uint32_t other : numbersOf(cluster))
      if (other != best.first) addUnion(best.first, other);
  }
}

// Logarithms of the mean tabulated values of a surfel in each ring; empty for rings without a photograph.
std::array<std::optional<std::array<float, 3>>, kRings> ringsOf(const Photographs& photographs, size_t surfel,
                                                                float white) {
  constexpr float kDark = 0.02f, kBright = 3, kLeastLink = 0.1f;
  std::array<Rgb, kRings> sums{};
  std::array<size_t, kRings> counts{};
  for (size_t i = photographs.first[surfel]; i < photographs.first[surfel + 1]; ++i) {
    const auto& at = photographs.directions[i];
    const float radius = std::hypot(at.halfU, at.halfV);
    const auto ring = static_cast<size_t>(std::ranges::upper_bound(kRingEdges, radius) - kRingEdges.begin());
    const Rgb value = 1 / (white * std::max(photographs.links[i], kLeastLink)) * photographs.reflectance[i];
    sums[ring] =
        sums[ring] + Rgb{std::min(kBright, value.r), std::min(kBright, value.g), std::min(kBright, value.b)};
    ++counts[ring];
  }
  std::array<std::optional<std::array<float, 3>>, kRings> rings;
  for (size_t ring = 0; ring < kRings; ++ring) {
    if (counts[ring] == 0) continue;
    const Rgb mean = 1 / static_cast<float>(counts[ring]) * sums[ring];
    rings[ring] = {std::log(kDark + mean.r), std::log(kDark + mean.g), std::log(kDark + mean.b)};
  }
  return rings;
}

} // namespace

std::vector<float> membershipIn(std::span<const uint32_t> cluster, uint32_t which) {
  std::vector<float> membership;
  for (const uint32_t of : cluster) membership.push_back(of == which ? 1.f : 0.f);
  return membership;
}

std::vector<RingProfile> ringProfiles(const Photographs& photographs, float white) {
  std::vector<decltype(ringsOf(photographs, 0, white))> all;
  std::array<std::array<double, 3>, kRings> means{};
  std::array<size_t, kRings> counts{};
  for (size_t s = 0; s < photographs.surfels(); ++s) {
    all.push_back(ringsOf(photographs, s, white));
    for (size_t ring = 0; ring < kRings; ++ring)
      if (all[s][ring]) {
        ++counts[ring];
        for (size_t c = 0; c < 3; ++c) means[ring][c] += (*all[s][ring])[c];
      }
  }
  std::vector<RingProfile> profiles(photographs.surfels());
  for (size_t s = 0; s < profiles.size(); ++s)
    for (size_t c = 0; c < 3; ++c) {
      float sum = 0, filled = 0; // of differences from the mean of all surfels
      for (size_t ring = 0; ring < kRings; ++ring)
        if (all[s][ring]) {
          profiles[s][3 * ring + c] =
              (*all[s][ring])[c] - static_cast<float>(means[ring][c] / static_cast<double>(counts[ring]));
          sum += profiles[s][3 * ring + c];
          ++filled;
        }
      for (size_t ring = 0; ring < kRings; ++ring)
        if (all[s][ring]) profiles[s][3 * ring + c] -= sum / filled;
    }
  return profiles;
}

std::vector<uint32_t> kMeans(std::span<const RingProfile> profiles, size_t k) {
  assert(k > 0);
  if (profiles.empty()) return {};
  constexpr int kMostRounds = 50;
  std::vector<RingProfile> centres = seedsOf(profiles, k);
  std::vector<uint32_t> cluster(profiles.size(), 0);
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<uint32_t> next;
    for (const RingProfile& profile : profiles) next.push_back(nearestOf(centres, profile));
    if (round > 0 && next == cluster) break;
    cluster = std::move(next);
    std::vector<std::array<double, std::tuple_size_v<RingProfile>>> sums(centres.size());
    std::vector<size_t> counts(centres.size());
    for (size_t s = 0; s < profiles.size(); ++s) {
      ++counts[cluster[s]];
      for (size_t i = 0; i < profiles[s].size(); ++i) sums[cluster[s]][i] += profiles[s][i];
    }
    for (size_t c = 0; c < centres.size(); ++c)
      for (size_t i = 0; i < centres[c].size() && counts[c] > 0; ++i)
        centres[c][i] = static_cast<float>(sums[c][i] / static_cast<double>(counts[c]));
  }
  return cluster;
}

Clusters findClusters(const Photographs& photographs, const ClusterOptions& options,
                      const Progress& progress) {
  constexpr int kReassignments = 2;
  if (photographs.size() == 0)
    return {1, std::vector<uint32_t>(photographs.surfels()), std::vector<float>(photographs.surfels())};
  const PhotographArrays thinned = subsetOf(photographs, thinnedSurfels(photographs, options.photographs));
  const Photographs few = thinned.view();
  const PhotographArrays seen = everyOther(few, 0), kept = everyOther(few, 1);
  const Photographs ofSeen = seen.view(), ofKept = kept.view();
  const IsotropicTables tables(ofSeen, options, progress);
  std::vector<uint32_t> cluster = kMeans(ringProfiles(ofSeen, options.white), options.mostClusters);
  const auto reassign = [&] {
    const size_t count = renumber(cluster);
    cluster = leastOf(errorsOf(tables, tablesOf(tables, cluster, count), few.surfels()), count);
  };
  for (int round = 0; round < kReassignments; ++round) reassign();
  merge({ofKept, options, progress}, cluster, options.mergeTolerance);
  for (int round = 0; round < kReassignments; ++round) reassign();
  const size_t count = renumber(cluster);
  const IsotropicTables whole(photographs, options, progress);
  Clusters clusters{count, {}, errorsOf(whole, tablesOf(tables, cluster, count), photographs.surfels())};
  clusters.of = leastOf(clusters.errors, count);
  return clusters;
}

std::vector<float> smoothedErrors(std::span<const Point3<AcquisitionSpace>> places,
                                  std::span<const float> errors, size_t neighbors) {
  assert(errors.size() % std::max<size_t>(1, places.size()) == 0);
  const NeighborIndex index(places);
  const size_t tables = places.empty() ? 0 : errors.size() / places.size();
  std::vector<float> smoothed(errors.size());
  tbb::parallel_for(size_t{0}, places.size(), [&](size_t s) {
    for (const auto& [neighbor, weight] : index.blended(places[s], neighbors))
      for (size_t t = 0; t < tables; ++t) smoothed[s * tables + t] += weight * errors[neighbor * tables + t];
  });
  return smoothed;
}

TableMixture mixtureOf(std::span<const float> errors) {
  assert(!errors.empty());
  constexpr double kSharpness = 8, kLeast = 1e-6;
  std::vector<uint16_t> order(errors.size());
  std::iota(order.begin(), order.end(), uint16_t{0});
  std::ranges::stable_sort(order, {}, [&](uint16_t table) { return errors[table]; });
  const double best = errors[order[0]] + kLeast;
  const auto score = [&](size_t rank) {
    return rank < order.size() ? std::pow(best / (errors[order[rank]] + kLeast), kSharpness) : 0;
  };
  TableMixture mixture;
  double sum = 0;
  const double last = std::min(score(kMixedTables), 1 - kLeast); // four equal errors: a third each, not 0 / 0
  for (size_t rank = 0; rank < kMixedTables; ++rank) sum += std::max(0.0, score(rank) - last);
  for (size_t rank = 0; rank < kMixedTables; ++rank) {
    mixture.table[rank] = rank < order.size() ? order[rank] : order[0];
    mixture.weight[rank] = static_cast<float>(std::max(0.0, score(rank) - last) / sum);
  }
  return mixture;
}

float tableShare(float tableError, float photographsError) {
  constexpr float kClearlyBetter = 0.7f; // of the other's error
  if (!(photographsError > 0)) return 0;
  const float t = std::clamp((1 - tableError / photographsError) / (1 - kClearlyBetter), 0.f, 1.f);
  return t * t * (3 - 2 * t);
}

} // namespace surflect::reflectance
