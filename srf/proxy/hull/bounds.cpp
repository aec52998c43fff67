#include "srf/proxy/hull/bounds.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace surflect::hull {

namespace {

using Box = Eigen::AlignedBox3d;

bool isPossible(std::span<const SilhouetteView> silhouetteViews, size_t quorum, const Ball& ball,
                bool dissent) {
  const size_t mostAgainst = dissent ? allowedDissent(silhouetteViews.size()) : 0;
  size_t against = 0, mayAgree = 0, left = silhouetteViews.size();
  for (const SilhouetteView& silhouetteView : silhouetteViews) {
    const BallVote vote = voteOn(silhouetteView, ball);
    against += vote.outside;
    mayAgree += vote.mayAgree;
    if (against > mostAgainst || mayAgree + --left < quorum) return false; // whatever the others say
  }
  return mayAgree >= quorum && against <= allowedDissent(mayAgree + against);
}

std::vector<Cube> fill(const Box& box, double edge) {
  const Vec3<int> count =
      (box.sizes() / edge - Vec3<double>::Constant(1e-9)).array().ceil().cast<int>().cwiseMax(1);
  std::vector<Cube> cubes;
  for (int z = 0; z < count[2]; ++z)
    for (int y = 0; y < count[1]; ++y)
      for (int x = 0; x < count[0]; ++x) cubes.push_back({box.min() + edge * Vec3<double>(x, y, z), edge});
  return cubes;
}

std::vector<Cube> split(const std::vector<Cube>& cubes) {
  std::vector<Cube> parts;
  parts.reserve(8 * cubes.size());
  for (const Cube& cube : cubes)
    for (int part = 0; part < 8; ++part)
      parts.push_back(
          {cube.low + cube.edge / 2 * Vec3<double>(part & 1, part >> 1 & 1, part >> 2), cube.edge / 2});
  return parts;
}

} // namespace

std::vector<Cube> possibleCubes(std::span<const SilhouetteView> silhouetteViews, size_t quorum,
                                const Box& box, int across, bool dissent, const Progress& progress) {
  constexpr int kLevels = 4;
  std::vector<Cube> cubes = fill(box, box.sizes().maxCoeff() / across * (1 << (kLevels - 1)));
  for (int level = 0; level < kLevels; ++level) {
    progress.checkpoint();
    if (level > 0) cubes = split(cubes);
    std::vector<uint8_t> possible(cubes.size());
    tbb::parallel_for(size_t{0}, cubes.size(), [&](size_t i) {
      possible[i] = isPossible(silhouetteViews, quorum, cubes[i].ball(), dissent);
    });
    size_t kept = 0;
    for (size_t i = 0; i < cubes.size(); ++i)
      if (possible[i]) cubes[kept++] = cubes[i];
    cubes.resize(kept);
  }
  return cubes;
}

Box startingBox(std::span<const SilhouetteView> silhouetteViews) {
  const auto center = pointInView(silhouetteViews);
  std::vector<double> reach;
  for (const SilhouetteView& silhouetteView : silhouetteViews) {
    const capture::Lens& lens = silhouetteView.camera.lens;
    reach.push_back(lens.model == capture::Lens::Model::orthographic
                        ? std::hypot(lens.width / lens.focalX, lens.height / lens.focalY)
                        : length(silhouetteView.camera.center() - center));
  }
  std::ranges::sort(reach);
  const double half = std::min(reach.back(), 2 * reach[reach.size() / 2]);
  return Box(center.raw().array() - half, center.raw().array() + half);
}

Box boundsOf(std::span<const SilhouetteView> silhouetteViews, size_t quorum, bool dissent,
             const Progress& progress) {
  constexpr int kAcross = 48, kRounds = 30;
  Box box = startingBox(silhouetteViews);
  const double point = 1e-9 * box.sizes().maxCoeff(); // width of a box if silhouettes only touch
  for (int round = 0; round < kRounds; ++round) {
    Box rest;
    for (const Cube& cube : possibleCubes(silhouetteViews, quorum, box, kAcross, dissent, progress))
      rest.extend(Box(cube.low, cube.low.array() + cube.edge));
    if (rest.isEmpty() || rest.sizes().maxCoeff() < point) return Box();
    const bool settled = rest.volume() > 0.7 * box.volume();
    box = rest;
    if (settled) break;
  }
  return box;
}

} // namespace surflect::hull
