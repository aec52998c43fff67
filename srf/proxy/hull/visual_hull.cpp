#include "srf/proxy/hull/visual_hull.h"

#include "srf/proxy/hull/bad_views.h"
#include "srf/proxy/hull/bounds.h"
#include "srf/proxy/hull/brick_grid.h"
#include "srf/proxy/hull/surface_nets.h"
#include "surfel/base/error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace surflect::hull {

namespace {

constexpr double kMostVoxels = 512; // along the longest side of the grid
constexpr int kSmoothing = 3;       // pairs of smoothing steps

std::string namesOf(std::span<const SilhouetteView> silhouetteViews, std::span<const size_t> which) {
  constexpr size_t kMost = 8;
  std::string names;
  for (size_t i = 0; i < std::min(kMost, which.size()); ++i)
    names += (i > 0 ? ", " : "") + silhouetteViews[which[i]].name;
  if (names.empty()) return "none (they meet in less than a voxel)";
  return names + (which.size() > kMost ? ", ..." : "");
}

// Views that vote against the point where most views agree.
std::vector<size_t> dissenters(std::span<const SilhouetteView> silhouetteViews,
                               const Eigen::AlignedBox3d& box) {
  constexpr int kAcross = 64;
  std::vector<size_t> fewest;
  size_t most = 0;
  for (int i = 0; i < kAcross * kAcross * kAcross; ++i) {
    const Vec3<double> share(i % kAcross + 0.5, i / kAcross % kAcross + 0.5, i / kAcross / kAcross + 0.5);
    const auto p = assume<Point3<AcquisitionSpace, double>>(
        Vec3<double>(box.min() + box.sizes().cwiseProduct(share) / kAcross));
    std::vector<size_t> against;
    size_t agree = 0;
    for (size_t view = 0; view < silhouetteViews.size(); ++view) {
      const auto distance = coneDistance(silhouetteViews[view], p);
      if (distance && !(*distance > 0)) against.push_back(view);
      agree += distance && *distance > 0;
    }
    if (agree <= most) continue;
    most = agree;
    fewest = std::move(against);
  }
  return fewest;
}

double medianFootprint(std::span<const SilhouetteView> silhouetteViews,
                       const Point3<AcquisitionSpace, double>& p) {
  std::vector<double> footprints;
  for (const SilhouetteView& silhouetteView : silhouetteViews)
    if (const double here = pixelFootprint(silhouetteView.camera, p); here > 0) footprints.push_back(here);
  const auto middle = footprints.begin() + static_cast<std::ptrdiff_t>(footprints.size() / 2);
  std::ranges::nth_element(footprints, middle);
  return *middle;
}

// Grid with a margin of two voxels around the box: one for the border, one for filled corners.
GridShape gridAround(const Eigen::AlignedBox3d& box, double voxel) {
  constexpr int kMargin = 2;
  GridShape shape;
  shape.voxel = voxel;
  shape.origin = box.min().array() - kMargin * voxel;
  for (int axis = 0; axis < 3; ++axis) {
    const double corners = std::ceil(box.sizes()[axis] / voxel) + 2 * kMargin + 1;
    shape.bricks[static_cast<size_t>(axis)] = static_cast<int>(std::ceil(corners / BrickGrid::kSide));
  }
  return shape;
}

// Moves vertices along their normals onto the zero of the field, because a net lies inside of the surface,
// most at ridges. Limited to half a voxel, because the field is discontinuous at image borders.
void project(TriangleMesh& mesh, std::span<const SilhouetteView> silhouetteViews, size_t quorum,
             double voxel) {
  std::vector<Vec3<double>> normals(mesh.positions.size(), Vec3<double>::Zero());
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t corner : mesh.triangles[t]) normals[corner] += areaVector(mesh, t);
  tbb::parallel_for(size_t{0}, normals.size(), [&](size_t i) {
    if (!(normals[i].norm() > 0)) return;
    const auto p = mesh.positions[i].cast<double>();
    const double inside = hullDistance(silhouetteViews, quorum, p, voxel / 2);
    mesh.positions[i] =
        assume<Point3<AcquisitionSpace>>(Vec3<double>(p.raw() + inside * normals[i].normalized()));
  });
}

} // namespace

VisualHull visualHull(std::span<const SilhouetteView> all, const HullOptions& options,
                      const Progress& progress) {
  VisualHull hull;
  std::vector<SilhouetteView> silhouetteViews;
  std::vector<size_t> indices;
  for (size_t view = 0; view < all.size(); ++view) {
    if (all[view].outline.isEmpty()) {
      hull.leftOut.push_back(view);
      continue;
    }
    silhouetteViews.push_back(all[view]);
    indices.push_back(view);
  }
  if (silhouetteViews.size() < 2)
    throw Error::mismatch("silhouettes of two views or more", std::to_string(silhouetteViews.size()));

  progress("visual hull", 0);
  const size_t fewest = quorumOf(silhouetteViews);
  const auto possible = boundsOf(silhouetteViews, fewest, true, progress);
  if (!possible.isEmpty()) {
    const auto bad = badViews(silhouetteViews, fewest, possible, progress);
    for (auto view = bad.rbegin(); view != bad.rend(); ++view) {
      hull.leftOut.push_back(indices[*view]);
      silhouetteViews.erase(silhouetteViews.begin() + static_cast<std::ptrdiff_t>(*view));
    }
    std::ranges::sort(hull.leftOut);
  }
  progress("visual hull", 0.2);

  const size_t quorum = quorumOf(silhouetteViews); // of the remaining views
  const auto box = boundsOf(silhouetteViews, quorum, false, progress);
  const auto empty = [&] {
    const auto against =
        dissenters(silhouetteViews, possible.isEmpty() ? startingBox(silhouetteViews) : possible);
    return Error("the silhouettes of the " + std::to_string(silhouetteViews.size()) +
                 " views have no point in common; where most of them agree, these do not: " +
                 namesOf(silhouetteViews, against) +
                 " (poses are camera to world, by OpenGL's axes: surflect inspect tells more)");
  };
  if (box.isEmpty()) throw empty();

  const double footprint =
      medianFootprint(silhouetteViews, assume<Point3<AcquisitionSpace, double>>(box.center()));
  hull.voxel = std::max(options.voxelPixels * footprint, box.sizes().maxCoeff() / kMostVoxels);
  const GridShape shape = gridAround(box, hull.voxel);
  BrickGrid grid(
      shape, [&](const Ball& ball) { return classify(silhouetteViews, quorum, ball); },
      [&](const Point3<AcquisitionSpace, double>& p) {
        return hullDistance(silhouetteViews, quorum, p, 2 * shape.voxel);
      },
      progress);
  progress("visual hull", 0.8);
  hull.mesh = surfaceNet(std::move(grid), progress);
  if (hull.mesh.triangles.empty()) throw empty(); // the object is smaller than a voxel
  project(hull.mesh, silhouetteViews, quorum, hull.voxel);
  hull.mesh = smoothed(std::move(hull.mesh), kSmoothing, progress);
  return hull;
}

} // namespace surflect::hull
