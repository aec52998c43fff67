#include "surfel/sampling.h"

#include "surfel/neighbors.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <random>

namespace surflect {

namespace {

// Random points on the mesh per surfel: the grain of the relaxation's centroids.
constexpr double kCandidatesPerSurfel = 16;
// Discs of this diameter, in spacings, thrown at that many candidates leave as many surfels as a hexagonal
// grid of the spacing has (measured: 0.60 surfels per squared diameter).
constexpr double kDiscDiameter = 0.72;
constexpr int kRelaxationRounds = 6;
constexpr double kOwnerReach = 0.8; // spacings; no candidate is farther from its surfel

struct Candidate {
  Vec3<double> position;
  Vec3<double> normal;
};

// For loops of small steps, over index i.
void checkNowAndThen(size_t i, const Progress& progress) {
  if (i % 4096 == 0) progress.checkpoint();
}

double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53; // the same on every standard library
}

// Equal shares of the area, one random point in each: stratified along the list of triangles.
std::vector<Candidate> scatter(const TriangleMesh& mesh, size_t count, std::mt19937_64& random,
                               const Progress& progress) {
  std::vector<Candidate> candidates;
  candidates.reserve(count);
  const double step = surfaceArea(mesh) / static_cast<double>(count);
  double areaBefore = 0;
  double next = step * uniform(random);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3<double> cross = areaVector(mesh, t);
    const double area = cross.norm() / 2;
    const auto& [ia, ib, ic] = mesh.triangles[t];
    const Vec3<double> a = mesh.positions[ia].cast<double>().raw(),
                       b = mesh.positions[ib].cast<double>().raw(),
                       c = mesh.positions[ic].cast<double>().raw();
    while (next < areaBefore + area) {
      checkNowAndThen(candidates.size(), progress);
      const double s = std::sqrt(uniform(random)), w = uniform(random); // uniform barycentrics
      candidates.push_back({(1 - s) * a + s * (1 - w) * b + s * w * c, cross.normalized()});
      next = step * (static_cast<double>(candidates.size()) + uniform(random));
    }
    areaBefore += area;
  }
  return candidates;
}

bool sameSheet(const Candidate& a, const Candidate& b) { return a.normal.dot(b.normal) > 0; }

// Points in cubic cells twice as wide as questions reach, found by a hash of the cell. Cells that share a
// hash are told apart by nothing but distance, so a visit may meet strangers, and the same point twice.
class Grid {
public:
  Grid(double reach, size_t points) : reach_(reach), first_(std::bit_ceil(points + 1), kNone) {}

  void add(const Vec3<double>& position) {
    uint32_t& first = first_[bucket(cellOf(position))];
    next_.push_back(first);
    first = static_cast<uint32_t>(next_.size() - 1);
  }

  // Visits all points within reach of the position, and some others, by the order of their addition.
  template <class Visit> void visitAround(const Vec3<double>& position, const Visit& visit) const {
    const Cell low = cellOf(position - Vec3<double>::Constant(reach_));
    for (int corner = 0; corner < 8; ++corner) {
      const Cell cell = {low[0] + (corner & 1), low[1] + (corner >> 1 & 1), low[2] + (corner >> 2)};
      for (uint32_t i = first_[bucket(cell)]; i != kNone; i = next_[i]) visit(i);
    }
  }

private:
  static constexpr uint32_t kNone = ~0u;
  using Cell = std::array<int64_t, 3>;

  Cell cellOf(const Vec3<double>& p) const {
    const Vec3<double> cell = (p / (2 * reach_)).array().floor();
    return {static_cast<int64_t>(cell[0]), static_cast<int64_t>(cell[1]), static_cast<int64_t>(cell[2])};
  }
  size_t bucket(const Cell& c) const {
    uint64_t hash = static_cast<uint64_t>(c[0]) * 0x9e3779b97f4a7c15u ^
                    static_cast<uint64_t>(c[1]) * 0xc2b2ae3d27d4eb4fu ^
                    static_cast<uint64_t>(c[2]) * 0x165667b19e3779f9u;
    hash ^= hash >> 32;
    return hash & (first_.size() - 1);
  }

  double reach_;
  std::vector<uint32_t> first_; // per bucket
  std::vector<uint32_t> next_;  // per point
};

// Accepts candidates one after the other unless a disc of their sheet is already there.
std::vector<Candidate> throwDiscs(const std::vector<Candidate>& candidates, double diameter,
                                  const Progress& progress) {
  std::vector<Candidate> accepted;
  Grid grid(diameter, candidates.size() / 8);
  for (size_t c = 0; c < candidates.size(); ++c) {
    checkNowAndThen(c, progress);
    const Candidate& candidate = candidates[c];
    bool crowded = false;
    grid.visitAround(candidate.position, [&](uint32_t i) {
      crowded |= sameSheet(accepted[i], candidate) &&
                 (accepted[i].position - candidate.position).squaredNorm() < diameter * diameter;
    });
    if (crowded) continue;
    grid.add(candidate.position);
    accepted.push_back(candidate);
  }
  return accepted;
}

// One round of Lloyd: each surfel moves to the centroid of the candidates nearest to it, brought back onto
// the plane of the candidate nearest to that centroid.
void relax(std::vector<Candidate>& surfels, const std::vector<Candidate>& candidates, double spacing,
           const Progress& progress) {
  const double reach = kOwnerReach * spacing;
  Grid grid(reach, surfels.size());
  for (const auto& surfel : surfels) grid.add(surfel.position);
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> owner(candidates.size(), kNone);
  tbb::parallel_for(size_t{0}, candidates.size(), [&](size_t c) {
    checkNowAndThen(c, progress);
    double nearest = reach * reach;
    grid.visitAround(candidates[c].position, [&](uint32_t i) {
      const double squared = (surfels[i].position - candidates[c].position).squaredNorm();
      if (squared < nearest && sameSheet(surfels[i], candidates[c])) {
        nearest = squared;
        owner[c] = i;
      }
    });
  });
  std::vector<Vec3<double>> centroid(surfels.size(), Vec3<double>::Zero());
  std::vector<size_t> members(surfels.size(), 0);
  for (size_t c = 0; c < candidates.size(); ++c) {
    checkNowAndThen(c, progress);
    if (owner[c] == kNone) continue;
    centroid[owner[c]] += candidates[c].position;
    ++members[owner[c]];
  }
  for (size_t i = 0; i < surfels.size(); ++i)
    centroid[i] =
        members[i] ? Vec3<double>(centroid[i] / static_cast<double>(members[i])) : surfels[i].position;
  std::vector<double> nearest(surfels.size(), std::numeric_limits<double>::infinity());
  for (size_t c = 0; c < candidates.size(); ++c) {
    checkNowAndThen(c, progress);
    if (owner[c] == kNone) continue;
    const size_t i = owner[c];
    const double squared = (candidates[c].position - centroid[i]).squaredNorm();
    if (squared >= nearest[i]) continue;
    nearest[i] = squared;
    const Vec3<double>& n = candidates[c].normal;
    surfels[i] = {centroid[i] - n * n.dot(centroid[i] - candidates[c].position), n};
  }
}

// Sorts along a space-filling curve through cells of the given size, so that neighbours in space become
// neighbours in memory; points of one cell keep their order.
void sortAlongCurve(std::vector<Candidate>& points, double cell, const Progress& progress) {
  Eigen::AlignedBox3d box;
  for (const auto& p : points) box.extend(p.position);
  const auto mortonCode = [&](const Candidate& p) {
    uint64_t code = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto index = static_cast<uint64_t>(std::min((p.position - box.min())[axis] / cell, 0x1p21 - 1));
      for (int bit = 0; bit < 21; ++bit) code |= (index >> bit & 1) << (3 * bit + axis);
    }
    return code;
  };
  std::vector<std::pair<uint64_t, uint32_t>> order(points.size());
  for (uint32_t i = 0; i < points.size(); ++i) {
    checkNowAndThen(i, progress);
    order[i] = {mortonCode(points[i]), i};
  }
  size_t comparisons = 0;
  std::ranges::sort(order, [&](const auto& a, const auto& b) {
    checkNowAndThen(++comparisons, progress);
    return a < b;
  });
  std::vector<Candidate> sorted;
  sorted.reserve(points.size());
  for (const auto& [code, i] : order) {
    checkNowAndThen(sorted.size(), progress);
    sorted.push_back(points[i]);
  }
  points = std::move(sorted);
}

} // namespace

double surfaceArea(const TriangleMesh& mesh) {
  double area = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) area += areaVector(mesh, t).norm() / 2;
  return area;
}

// Density of a hexagonal grid.
double surfelsAt(const TriangleMesh& mesh, double spacing) {
  return 2 / std::sqrt(3.0) * surfaceArea(mesh) / (spacing * spacing);
}

double spacingFor(const TriangleMesh& mesh, size_t count) {
  return std::sqrt(2 / std::sqrt(3.0) * surfaceArea(mesh) / static_cast<double>(std::max<size_t>(count, 1)));
}

SurfelCloud sampleSurfels(const TriangleMesh& mesh, double spacing, uint64_t seed, const Progress& progress) {
  assert(spacing > 0);
  std::mt19937_64 random(seed);
  const double expected = surfelsAt(mesh, spacing);
  auto candidates =
      scatter(mesh, static_cast<size_t>(std::ceil(expected * kCandidatesPerSurfel)) + 16, random, progress);
  for (size_t i = candidates.size(); i > 1; --i) { // Fisher-Yates, the same on every standard library
    checkNowAndThen(i, progress);
    std::swap(candidates[i - 1], candidates[random() % i]);
  }
  sortAlongCurve(candidates, 8 * spacing, progress); // random within neighbourhoods that fit the cache
  auto surfels = throwDiscs(candidates, kDiscDiameter * spacing, progress);
  for (int round = 0; round < kRelaxationRounds; ++round) {
    progress("surfels", static_cast<double>(round) / kRelaxationRounds);
    relax(surfels, candidates, spacing, progress);
  }
  sortAlongCurve(surfels, spacing, progress);
  SurfelCloud cloud;
  for (const auto& surfel : surfels) {
    cloud.p0.push_back(assume<Point3<AcquisitionSpace>>(surfel.position));
    cloud.r0.push_back(rodriguesOf(assume<Normal3<AcquisitionSpace, double>>(surfel.normal)));
  }
  estimateSplats(cloud, progress);
  return cloud;
}

void estimateSplats(SurfelCloud& cloud, const Progress& progress) {
  constexpr size_t kNeighbors = 6;
  constexpr float kReach = 3;          // sigmas at which a Gaussian is forgotten
  constexpr float kSameSheet = -0.25f; // cosine below which two surfels lie on the two sides of a sheet
  // Splats help each other to cover a place only if they are seen together. Across a sharp edge, or where one
  // surface pierces another, a viewer may see one face alone, which must then be closed by itself.
  constexpr float kOneFace = 0.5f; // cosine
  constexpr int kRounds = 8;
  constexpr float kLargestRadius = 2; // medians
  const size_t n = cloud.size();
  const NeighborIndex index(cloud.p0);
  std::vector<Vec3<float>> normals(n);
  for (size_t i = 0; i < n; ++i) normals[i] = rotationOf<float>(cloud.r0[i]).col(2);

  cloud.radius.resize(n);
  tbb::parallel_for(size_t{0}, n, [&](size_t i) {
    checkNowAndThen(i, progress);
    float sum = 0;
    size_t count = 0;
    for (const auto& [j, distance] : index.nearest(cloud.p0[i], 2 * kNeighbors + 1))
      if (j != i && count < kNeighbors && normals[i].dot(normals[j]) > kSameSheet) {
        sum += distance;
        ++count;
      }
    cloud.radius[i] = count ? sum / static_cast<float>(count) : std::numeric_limits<float>::infinity();
  });
  if (n > 0) { // a speck has its neighbours far away: no reason to cover what lies between
    std::vector<float> sorted = cloud.radius;
    const auto median = sorted.begin() + static_cast<std::ptrdiff_t>(n / 2);
    std::ranges::nth_element(sorted, median);
    const float limit = std::isfinite(*median) ? kLargestRadius * *median : 0;
    for (float& radius : cloud.radius) radius = std::min(radius, limit);
  }

  struct Link {
    uint32_t j;
    float gaussian; // of surfel j at the place of surfel i
  };
  std::vector<std::vector<Link>> links(n);
  const float widest = n ? *std::ranges::max_element(cloud.radius) * kSigmaPerRadius * kReach : 0;
  tbb::parallel_for(size_t{0}, n, [&](size_t i) {
    checkNowAndThen(i, progress);
    for (const auto& [j, distance] : index.within(cloud.p0[i], widest)) {
      const float sigma = kSigmaPerRadius * cloud.radius[j];
      if (distance > kReach * sigma && j != i) continue;
      if (normals[i].dot(normals[j]) <= kOneFace) continue;
      const float ratio = sigma > 0 ? distance / sigma : 0;
      links[i].push_back({j, std::exp(-0.5f * ratio * ratio)});
    }
  });

  // Fixed point of coverage_i <- coverage_i / (sum of the Gaussians at surfel i).
  cloud.coverage.assign(n, 1.f);
  std::vector<float> next(n);
  for (int round = 0; round < kRounds; ++round) {
    tbb::parallel_for(size_t{0}, n, [&](size_t i) {
      float sum = 0;
      for (const auto& [j, gaussian] : links[i]) sum += cloud.coverage[j] * gaussian;
      next[i] = cloud.coverage[i] / sum;
    });
    cloud.coverage.swap(next);
  }
}

} // namespace surflect
