#include "srf/proxy/mesh/mesh_strays.h"

#include "surfel/base/evenly_spaced.h"
#include "surfel/geometry/ray_caster.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace surflect::proxy {

namespace {

using World = AcquisitionSpace;
using Box = Eigen::AlignedBox3d;

constexpr double kTrimmed = 0.01;  // of the vertices, at either end of an axis
constexpr double kFarSpike = 10;   // diagonals
constexpr double kFarSpeck = 1;    // diagonals
constexpr double kBodyArea = 0.99; // of all
constexpr double kSeenShare = 0.1;
constexpr size_t kStrayViews = 16;
constexpr int kSide = 64; // rays along each side of a picture

// Box of the vertices without the outermost along each axis, one at least at each end.
Box boxOfMost(const std::vector<Point3<World>>& positions) {
  const size_t count = positions.size(),
               trimmed = std::min(static_cast<size_t>(std::ceil(kTrimmed * static_cast<double>(count))),
                                  (count - 1) / 2);
  Vec3<double> low, high;
  std::vector<double> values(count);
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < count; ++i) values[i] = positions[i].raw()[axis];
    const auto nth = [&](size_t n) {
      std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(n));
      return values[n];
    };
    low[axis] = nth(trimmed);
    high[axis] = nth(count - 1 - trimmed);
  }
  return {low, high};
}

TriangleMesh subMesh(const TriangleMesh& mesh, const std::vector<uint8_t>& isChosen, bool chosen) {
  TriangleMesh sub{mesh.positions, {}};
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    if ((isChosen[t] != 0) == chosen) sub.triangles.push_back(mesh.triangles[t]);
  return withoutUnused(std::move(sub));
}

// Fraction of the pixels covered by either mesh in which `some` is in front.
double seenShare(const TriangleMesh& some, const TriangleMesh& others,
                 std::span<const capture::Camera<World>> cameras, const Progress& progress) {
  const RayCaster<World> ofSome(some, progress), ofOthers(others, progress); // each at its own precision
  size_t seen = 0, all = 0;
  for (const size_t i : evenlySpaced(cameras.size(), kStrayViews)) {
    progress.checkpoint();
    const capture::Camera<World>& camera = cameras[i];
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const auto ray = capture::rayThrough(
            camera.lens, {(x + 0.5) / kSide * camera.lens.width, (y + 0.5) / kSide * camera.lens.height});
        if (!ray) continue;
        const auto origin = worldFromCamera(ray->origin);
        const auto direction = worldFromCamera(ray->direction);
        const auto a = ofSome.firstHit(origin, direction), b = ofOthers.firstHit(origin, direction);
        all += a || b;
        seen += a && (!b || a->distance < b->distance);
      }
  }
  return all > 0 ? static_cast<double>(seen) / static_cast<double>(all) : 0;
}

} // namespace

Spikes spikesIn(const TriangleMesh& mesh, std::span<const capture::Camera<World>> cameras,
                const Progress& progress) {
  const Box most = boxOfMost(mesh.positions);
  const double reach = kFarSpike * most.diagonal().norm();
  Spikes spikes;
  if (!(reach > 0)) return spikes;
  std::vector<uint8_t> isSpike(mesh.triangles.size(), 0);
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    progress.checkNowAndThen(t);
    for (const uint32_t corner : mesh.triangles[t]) {
      const Vec3<double> p = mesh.positions[corner].cast<double>().raw();
      if (most.exteriorDistance(p) <= reach) continue;
      isSpike[t] = 1;
      if (spikes.triangles.empty() ||
          most.squaredExteriorDistance(p) > most.squaredExteriorDistance(spikes.farthest))
        spikes.farthest = p;
    }
    if (isSpike[t]) spikes.triangles.push_back(t);
  }
  if (spikes.triangles.empty()) return spikes;
  spikes.areSeen =
      spikes.triangles.size() == mesh.triangles.size() ||
      seenShare(subMesh(mesh, isSpike, true), subMesh(mesh, isSpike, false), cameras, progress) > kSeenShare;
  return spikes;
}

std::vector<size_t> specksAmong(const std::vector<MeshParts::Part>& parts,
                                std::span<const capture::Camera<World>> cameras) {
  std::vector<size_t> order(parts.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, std::ranges::greater(), [&](size_t i) { return parts[i].area; });
  double total = 0, sum = 0;
  for (const auto& part : parts) total += part.area;
  Box body;
  size_t bodyParts = 0;
  for (; bodyParts < order.size() && sum < kBodyArea * total; ++bodyParts) {
    sum += parts[order[bodyParts]].area;
    body.extend(parts[order[bodyParts]].box);
  }
  std::vector<size_t> specks;
  for (const size_t i : std::span(order).subspan(bodyParts)) {
    if (body.exteriorDistance(parts[i].box) <= kFarSpeck * body.diagonal().norm()) continue;
    const auto middle = assume<Point3<World, double>>(parts[i].box.center());
    const auto shows = std::ranges::count_if(cameras, [&](const capture::Camera<World>& camera) {
      const auto pixel = camera.project(middle);
      return pixel && capture::contains(camera.lens, *pixel);
    });
    if (2 * static_cast<size_t>(shows) < cameras.size()) specks.push_back(i);
  }
  std::ranges::sort(specks);
  return specks;
}

} // namespace surflect::proxy
