#include "surfel/sampling.h"

#include "surfel/base/text.h"
#include "surfel/geometry/neighbors.h"
#include "surfel/geometry/smooth_normals.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <random>
#include <span>

namespace surflect {

namespace {

// Random points on the mesh per surfel, by which the relaxation's centroids are computed.
constexpr double kPointsPerSurfel = 16;
// Disc diameter in spacings at which dart throwing on that many points leaves as many surfels as a hexagonal
// grid of the spacing (measured: 0.60 surfels per squared diameter).
constexpr double kDiscDiameter = 0.72;
constexpr int kRelaxationRounds = 6;
constexpr double kOwnerReach = 0.8; // spacings; largest distance of a point from its surfel

struct SurfacePoint {
  Vec3<double> position;
  Vec3<double> normal; // of its triangle
  uint32_t triangle;
};

double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53; // identical on every standard library
}

// Random points in equal shares of the area: stratified along the list of triangles.
std::vector<SurfacePoint> scatter(const TriangleMesh& mesh, size_t count, std::mt19937_64& random,
                                  const Progress& progress) {
  std::vector<SurfacePoint> points;
  points.reserve(count);
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
      progress.checkNowAndThen(points.size());
      const double s = std::sqrt(uniform(random)), w = uniform(random); // uniform barycentrics
      points.push_back(
          {(1 - s) * a + s * (1 - w) * b + s * w * c, cross.normalized(), static_cast<uint32_t>(t)});
      next = step * (static_cast<double>(points.size()) + uniform(random));
    }
    areaBefore += area;
  }
  return points;
}

bool sameSheet(const SurfacePoint& a, const SurfacePoint& b) { return a.normal.dot(b.normal) > 0; }

// Points in cubic cells twice as wide as the search radius, hashed by cell. Cells with equal hashes share a
// bucket, so a visit may meet far points, and a point twice.
class Grid {
public:
  Grid(double reach, size_t points) : reach_(reach), first_(std::bit_ceil(points + 1), kNone) {}

  void add(const Vec3<double>& position) {
    uint32_t& first = first_[bucket(cellOf(position))];
    next_.push_back(first);
    first = static_cast<uint32_t>(next_.size() - 1);
  }

  // Visits all points within the root of `squared` (at most reach), which visits may decrease, and some
  // others, until a visit returns true. The position's own cell comes first.
  template <class Visit>
  bool anyNearer(const Vec3<double>& position, const double& squared, const Visit& visit) const {
    const Cell home = cellOf(position), low = cellOf(position - Vec3<double>::Constant(reach_));
    Cell other;
    Vec3<double> gap; // squared distance to the neighbouring cell within reach, along each axis
    for (size_t axis = 0; axis < 3; ++axis) {
      other[axis] = home[axis] == low[axis] ? home[axis] + 1 : low[axis];
      const double border = 2 * reach_ * static_cast<double>(low[axis] + 1),
                   p = position[static_cast<int>(axis)];
      gap[static_cast<int>(axis)] = (p - border) * (p - border);
    }
    for (int corner = 0; corner < 8; ++corner) {
      const bool x = corner & 1, y = corner & 2, z = corner & 4;
      if (x * gap[0] + y * gap[1] + z * gap[2] >= squared) continue;
      const Cell cell = {x ? other[0] : home[0], y ? other[1] : home[1], z ? other[2] : home[2]};
      for (uint32_t i = first_[bucket(cell)]; i != kNone; i = next_[i])
        if (visit(i)) return true;
    }
    return false;
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

// Dart throwing: accepts points unless a disc of the same sheet already covers them.
std::vector<SurfacePoint> throwDiscs(const std::vector<SurfacePoint>& points, double diameter,
                                     const Progress& progress) {
  std::vector<SurfacePoint> accepted;
  Grid grid(diameter, points.size() / 8);
  for (size_t p = 0; p < points.size(); ++p) {
    progress.checkNowAndThen(p);
    const SurfacePoint& point = points[p];
    const bool crowded = grid.anyNearer(point.position, diameter * diameter, [&](uint32_t i) {
      return sameSheet(accepted[i], point) &&
             (accepted[i].position - point.position).squaredNorm() < diameter * diameter;
    });
    if (crowded) continue;
    grid.add(point.position);
    accepted.push_back(point);
  }
  return accepted;
}

// Voronoi cells: the points nearest to each surfel of the same sheet, within reach.
struct Cells {
  std::vector<size_t> first;    // start of each surfel's points, and the end
  std::vector<uint32_t> points; // ascending within a surfel

  std::span<const uint32_t> of(size_t surfel) const {
    return std::span(points).subspan(first[surfel], first[surfel + 1] - first[surfel]);
  }
};

Cells cellsOf(const std::vector<SurfacePoint>& surfels, const std::vector<SurfacePoint>& points, double reach,
              const Progress& progress) {
  Grid grid(reach, surfels.size());
  for (const auto& surfel : surfels) grid.add(surfel.position);
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> owner(points.size(), kNone);
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t p) {
    progress.checkNowAndThen(p);
    double nearest = reach * reach;
    grid.anyNearer(points[p].position, nearest, [&](uint32_t i) {
      const double squared = (surfels[i].position - points[p].position).squaredNorm();
      if (squared < nearest && sameSheet(surfels[i], points[p])) {
        nearest = squared;
        owner[p] = i;
      }
      return false;
    });
  });

  Cells cells{std::vector<size_t>(surfels.size() + 1), {}};
  for (const uint32_t surfel : owner)
    if (surfel != kNone) ++cells.first[surfel + 1];
  std::partial_sum(cells.first.begin(), cells.first.end(), cells.first.begin());
  cells.points.resize(cells.first.back());
  std::vector<size_t> next(cells.first.begin(), cells.first.end() - 1);
  for (uint32_t p = 0; p < points.size(); ++p) {
    progress.checkNowAndThen(p);
    if (owner[p] != kNone) cells.points[next[owner[p]]++] = p;
  }
  return cells;
}

// One round of Lloyd's relaxation: each surfel moves to the centroid of its cell, projected onto the plane of
// the point nearest to that centroid.
void relax(std::vector<SurfacePoint>& surfels, const std::vector<SurfacePoint>& points, double spacing,
           const Progress& progress) {
  const Cells cells = cellsOf(surfels, points, kOwnerReach * spacing, progress);
  tbb::parallel_for(size_t{0}, surfels.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    const std::span<const uint32_t> members = cells.of(i);
    if (members.empty()) return;
    Vec3<double> centroid = Vec3<double>::Zero();
    for (const uint32_t p : members) centroid += points[p].position;
    centroid /= static_cast<double>(members.size());
    const auto distance = [&](uint32_t p) { return (points[p].position - centroid).squaredNorm(); };
    const SurfacePoint& nearest = points[*std::ranges::min_element(members, {}, distance)];
    const Vec3<double>& n = nearest.normal;
    surfels[i] = {centroid - n * n.dot(centroid - nearest.position), n, nearest.triangle};
  });
}

// Sorts along a space-filling curve through cells of the given size, so that neighbours in space are
// neighbours in memory. Points of one cell are ordered by their ranks, which are distinct.
std::vector<SurfacePoint> alongCurve(const std::vector<SurfacePoint>& points,
                                     const std::vector<uint32_t>& ranks, double cell,
                                     const Progress& progress) {
  Eigen::AlignedBox3d box;
  for (const auto& p : points) box.extend(p.position);
  const auto mortonCode = [&](const SurfacePoint& p) {
    uint64_t code = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto index = static_cast<uint64_t>(std::min((p.position - box.min())[axis] / cell, 0x1p21 - 1));
      for (int bit = 0; bit < 21; ++bit) code |= (index >> bit & 1) << (3 * bit + axis);
    }
    return code;
  };
  struct Place {
    uint64_t code;
    uint32_t rank, point;
  };
  std::vector<Place> order(points.size());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    order[i] = {mortonCode(points[i]), ranks[i], static_cast<uint32_t>(i)};
  });
  tbb::parallel_sort(order, [&](const Place& a, const Place& b) {
    progress.checkNowAndThen(a.rank);
    return a.code != b.code ? a.code < b.code : a.rank < b.rank;
  });
  std::vector<SurfacePoint> sorted(points.size());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t i) {
    progress.checkNowAndThen(i);
    sorted[i] = points[order[i].point];
  });
  return sorted;
}

// Random permutation of 0..count-1 by Fisher-Yates, identical on every standard library.
std::vector<uint32_t> shuffled(size_t count, std::mt19937_64& random, const Progress& progress) {
  std::vector<uint32_t> numbers = upTo(count);
  for (size_t i = count; i > 1; --i) {
    progress.checkNowAndThen(i);
    std::swap(numbers[i - 1], numbers[random() % i]);
  }
  return numbers;
}

std::vector<uint32_t> inverse(const std::vector<uint32_t>& permutation) {
  std::vector<uint32_t> result(permutation.size());
  for (uint32_t i = 0; i < permutation.size(); ++i) result[permutation[i]] = i;
  return result;
}

// Target sum of the Gaussians at a surfel, by the offset of the centre of mass of its own and its neighbours'
// from it, in standard deviations. At distance x inside a straight border, a half plane of Gaussians has
//   sum = Phi(x),   offset = phi(x) / Phi(x),
// phi and Phi the normal density and distribution: sum = 1 - 0.6 offset, within 0.021. Splats at a border are
// wider than others, because they have fewer neighbours; 0.85 compensates. Irregular spacing inside a sheet
// causes offsets up to 0.2.
float sumWithin(float offset) {
  const float t = std::clamp((offset - 0.15f) / 0.15f, 0.f, 1.f);
  return 1 - 0.85f * std::min(offset, 0.8f) * t * t * (3 - 2 * t);
}

} // namespace

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
  auto points =
      scatter(mesh, static_cast<size_t>(std::ceil(expected * kPointsPerSurfel)) + 16, random, progress);
  // Random order within neighbourhoods that fit the cache.
  points = alongCurve(points, inverse(shuffled(points.size(), random, progress)), 8 * spacing, progress);
  auto surfels = throwDiscs(points, kDiscDiameter * spacing, progress);
  for (int round = 0; round < kRelaxationRounds; ++round) {
    progress("surfels", static_cast<double>(round) / kRelaxationRounds);
    relax(surfels, points, spacing, progress);
  }
  surfels = alongCurve(surfels, upTo(surfels.size()), spacing, progress);
  const SmoothNormals normals(mesh, progress);
  SurfelCloud cloud;
  for (const auto& surfel : surfels) {
    const Vec3<double> n = normals.at(surfel.triangle, surfel.position);
    cloud.p0.push_back(assume<Point3<AcquisitionSpace>>(surfel.position));
    cloud.r0.push_back(rodriguesOf(assume<Normal3<AcquisitionSpace, double>>(n)));
  }
  estimateSplats(cloud, progress);
  return cloud;
}

void estimateSplats(SurfelCloud& cloud, const Progress& progress) {
  constexpr size_t kNeighbors = 6;
  constexpr float kReach = 3;          // sigmas beyond which a Gaussian is ignored
  constexpr float kSameSheet = -0.25f; // cosine below which two surfels are on opposite sides of a sheet
  // Splats cover a place together only if they are visible together. Across a sharp edge, or where surfaces
  // intersect, a viewer may see one face alone, which must be closed by itself. To detect borders, splats
  // across the edge count too: a face's own sum falls to two thirds there instead of a half. Counting the
  // face alone would make thin strands consist of borders, with gaps.
  constexpr float kOneFace = 0.5f; // cosine
  constexpr int kRounds = 8;
  constexpr float kLargestRadius = 2; // medians
  const size_t n = cloud.size();
  const NeighborIndex index(cloud.p0, progress);
  std::vector<Vec3<float>> normals(n);
  for (size_t i = 0; i < n; ++i) normals[i] = rotationOf<float>(cloud.r0[i]).col(2);

  cloud.radius.resize(n);
  tbb::parallel_for(size_t{0}, n, [&](size_t i) {
    progress.checkNowAndThen(i);
    float sum = 0;
    size_t count = 0;
    for (const auto& [j, distance] : index.nearest(cloud.p0[i], 2 * kNeighbors + 1))
      if (j != i && count < kNeighbors && normals[i].dot(normals[j]) > kSameSheet) {
        sum += distance;
        ++count;
      }
    cloud.radius[i] = count ? sum / static_cast<float>(count) : std::numeric_limits<float>::infinity();
  });
  if (n > 0) { // a speck has no near neighbours: the space between is not covered
    std::vector<float> sorted = cloud.radius;
    const auto median = sorted.begin() + static_cast<std::ptrdiff_t>(n / 2);
    std::ranges::nth_element(sorted, median);
    const float limit = std::isfinite(*median) ? kLargestRadius * *median : 0;
    for (float& radius : cloud.radius) radius = std::min(radius, limit);
  }

  struct Link {
    uint32_t j;
    float gaussian; // of surfel j at surfel i
  };
  std::vector<std::vector<Link>> links(n);
  std::vector<float> wanted(n); // target sum of the Gaussians at each surfel
  const float widest = n ? *std::ranges::max_element(cloud.radius) * kSigmaPerRadius * kReach : 0;
  tbb::parallel_for(size_t{0}, n, [&](size_t i) {
    progress.checkNowAndThen(i);
    Vec3<float> offset = Vec3<float>::Zero();
    float sum = 0;
    for (const auto& [j, distance] : index.within(cloud.p0[i], widest)) {
      const float sigma = kSigmaPerRadius * cloud.radius[j];
      if (distance > kReach * sigma && j != i) continue;
      const float cosine = normals[i].dot(normals[j]);
      if (cosine <= kSameSheet) continue;
      const float ratio = sigma > 0 ? distance / sigma : 0;
      const float gaussian = std::exp(-0.5f * ratio * ratio);
      offset += gaussian * (cloud.p0[j].raw() - cloud.p0[i].raw());
      sum += gaussian;
      if (cosine > kOneFace) links[i].push_back({j, gaussian});
    }
    offset -= normals[i].dot(offset) * normals[i];
    const float sigma = kSigmaPerRadius * cloud.radius[i];
    wanted[i] = sigma > 0 ? sumWithin(offset.norm() / (sum * sigma)) : 1;
  });

  // Fixed-point iteration: coverage_i <- coverage_i wanted_i / (sum of the Gaussians at surfel i).
  cloud.coverage.assign(n, 1.f);
  std::vector<float> next(n);
  for (int round = 0; round < kRounds; ++round) {
    tbb::parallel_for(size_t{0}, n, [&](size_t i) {
      float sum = 0;
      for (const auto& [j, gaussian] : links[i]) sum += cloud.coverage[j] * gaussian;
      next[i] = cloud.coverage[i] * wanted[i] / sum;
    });
    cloud.coverage.swap(next);
  }
}

} // namespace surflect
