#include "srf/proxy/relief/relief.h"

#include "srf/proxy/relief/frontal_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace surflect::relief {

namespace {

// Twice the signed area of a triangle in the picture; positive for the winding of CornerMesh.
double twiceArea(const Vec2<double>& a, const Vec2<double>& b, const Vec2<double>& c) {
  return (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]);
}

// A quad cut into two triangles.
struct Cut {
  bool isFromFirst; // by the diagonal from the first to the third corner; otherwise second to fourth
  double leastArea; // twice the smaller area
};
Cut bestCut(const std::array<Vec2<double>, 4>& q) {
  const double fromFirst = std::min(twiceArea(q[0], q[1], q[2]), twiceArea(q[0], q[2], q[3]));
  const double fromSecond = std::min(twiceArea(q[1], q[2], q[3]), twiceArea(q[1], q[3], q[0]));
  return {fromFirst >= fromSecond, std::max(fromFirst, fromSecond)};
}

// Corners of pixels, row by row, moved so that the mask's outline is smooth: each outline corner moves
// towards its two neighbours, as by a Gaussian of two pixels, but less than half a pixel. Corners whose pixel
// would fold over stay.
std::vector<Vec2<double>> smoothCorners(const image::Mask& mask) {
  constexpr int kRounds = 8;          // of variance 1/2 each
  constexpr double kFarthest = 0.45;  // pixels, in each coordinate
  constexpr double kLeastArea = 1e-3; // of a triangle, twice, in pixels
  const int across = mask.width + 1, down = mask.height + 1;
  const auto isInside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < mask.width && y < mask.height &&
           mask.inside[static_cast<size_t>(y) * static_cast<size_t>(mask.width) + static_cast<size_t>(x)];
  };
  std::vector<Vec2<double>> corners;
  struct OnOutline {
    size_t corner, before, after;
  };
  std::vector<OnOutline> outline;
  for (int y = 0; y < down; ++y)
    for (int x = 0; x < across; ++x) {
      const size_t here = corners.size();
      corners.emplace_back(x, y);
      std::vector<size_t>
          next; // next corner along the outline, by an edge between an inside and an outside pixel
      if (isInside(x, y - 1) != isInside(x, y)) next.push_back(here + 1);
      if (isInside(x - 1, y - 1) != isInside(x - 1, y)) next.push_back(here - 1);
      if (isInside(x - 1, y) != isInside(x, y)) next.push_back(here + static_cast<size_t>(across));
      if (isInside(x - 1, y - 1) != isInside(x, y - 1)) next.push_back(here - static_cast<size_t>(across));
      if (next.size() == 2) outline.push_back({here, next[0], next[1]});
    }
  const std::vector<Vec2<double>> grid = corners;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Vec2<double>> last = corners;
    for (const auto& [corner, before, after] : outline) {
      const Vec2<double> drawn = (last[before] + 2 * last[corner] + last[after]) / 4 - grid[corner];
      corners[corner] = grid[corner] + drawn.cwiseMax(-kFarthest).cwiseMin(kFarthest);
    }
  }
  for (bool isFolded = true; isFolded;) {
    isFolded = false;
    for (int y = 0; y < mask.height; ++y)
      for (int x = 0; x < mask.width; ++x) {
        if (!isInside(x, y)) continue;
        const size_t i = static_cast<size_t>(y) * static_cast<size_t>(across) + static_cast<size_t>(x);
        const std::array quad{i, i + static_cast<size_t>(across), i + static_cast<size_t>(across) + 1, i + 1};
        if (bestCut({corners[quad[0]], corners[quad[1]], corners[quad[2]], corners[quad[3]]}).leastArea >
            kLeastArea)
          continue;
        for (const size_t corner : quad) corners[corner] = grid[corner];
        isFolded = true;
      }
  }
  return corners;
}

// Mesh over corners of pixels; vertices are created on demand.
class CornerMesh {
public:
  // `places` of all corners, row by row; empty: on the grid. depthAt(corner x, corner y, image point) gives
  // depths.
  CornerMesh(const capture::Camera<AcquisitionSpace>& camera, std::vector<Vec2<double>> places,
             std::function<double(int, int, const Vec2<double>&)> depthAt)
      : lens_(camera.lens), worldFromCamera_(camera.cameraFromWorld.inverse()), places_(std::move(places)),
        depthAt_(std::move(depthAt)),
        index_(static_cast<size_t>(lens_.width + 1) * static_cast<size_t>(lens_.height + 1), kUnasked) {}

  // Adds the pixels left <= x < right, top <= y < bottom; returns false if a corner has no ray.
  bool addQuad(int left, int top, int right, int bottom) {
    const std::array corners{corner(left, top), corner(left, bottom), corner(right, bottom),
                             corner(right, top)};
    if (std::ranges::count(corners, kNone) > 0) return false;
    const size_t first =
        bestCut({place(left, top), place(left, bottom), place(right, bottom), place(right, top)}).isFromFirst
            ? 0
            : 1;
    const auto at = [&](size_t k) { return corners[(first + k) % 4]; };
    mesh_.triangles.push_back({at(0), at(1), at(2)});
    mesh_.triangles.push_back({at(0), at(2), at(3)});
    return true;
  }
  TriangleMesh take() { return std::move(mesh_); }

private:
  static constexpr uint32_t kUnasked = 0xFFFFFFFF, kNone = 0xFFFFFFFE;

  size_t numberOf(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(lens_.width + 1) + static_cast<size_t>(x);
  }
  Vec2<double> place(int x, int y) const {
    return places_.empty() ? Vec2<double>(x, y) : places_[numberOf(x, y)];
  }

  uint32_t corner(int x, int y) {
    uint32_t& index = index_[numberOf(x, y)];
    if (index != kUnasked) return index;
    const Vec2<double> pixel = place(x, y);
    const auto q = imagePoint(lens_, {pixel[0], pixel[1]});
    if (!q) return index = kNone;
    index = static_cast<uint32_t>(mesh_.positions.size());
    mesh_.positions.push_back(worldFromCamera_(atDepth(lens_, *q, depthAt_(x, y, *q))).cast<float>());
    return index;
  }

  const capture::Lens& lens_;
  Rigid<AcquisitionSpace, CameraSpace> worldFromCamera_;
  std::vector<Vec2<double>> places_;
  std::function<double(int, int, const Vec2<double>&)> depthAt_;
  std::vector<uint32_t> index_;
  TriangleMesh mesh_;
};

} // namespace

TriangleMesh reliefMesh(const capture::Camera<AcquisitionSpace>& camera, const DepthMap& map) {
  const bool isPinhole = camera.lens.model == capture::Lens::Model::pinhole;
  const auto index = [&](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(map.mask.width) + static_cast<size_t>(x);
  };
  // Depth of a corner: the mean over the pixels around it.
  CornerMesh mesh(camera, smoothCorners(map.mask), [&](int cornerX, int cornerY, const Vec2<double>& q) {
    double sum = 0;
    int count = 0;
    for (int y = std::max(0, cornerY - 1); y <= std::min(map.mask.height - 1, cornerY); ++y)
      for (int x = std::max(0, cornerX - 1); x <= std::min(map.mask.width - 1, cornerX); ++x)
        if (const size_t i = index(x, y); map.mask.inside[i]) {
          const Vec2<double> step = q - *imagePoint(camera.lens, {x + 0.5, y + 0.5});
          const double value = isPinhole ? std::log(map.depth[i]) : map.depth[i];
          sum += value + map.gradient[i].dot(step);
          ++count;
        }
    return isPinhole ? std::exp(sum / count) : sum / count;
  });
  for (int y = 0; y < map.mask.height; ++y)
    for (int x = 0; x < map.mask.width; ++x)
      if (map.mask.inside[index(x, y)]) mesh.addQuad(x, y, x + 1, y + 1);
  return mesh.take();
}

TriangleMesh planeMesh(const capture::Camera<AcquisitionSpace>& camera, const image::Mask& mask) {
  constexpr int kBlock = 8;
  const double depth = frontalDepth(camera);
  CornerMesh mesh(camera, {}, [&](int, int, const Vec2<double>&) { return depth; });
  const auto isInside = [&](int x, int y) {
    return mask.inside[static_cast<size_t>(y) * static_cast<size_t>(mask.width) + static_cast<size_t>(x)] !=
           0;
  };
  for (int top = 0; top < mask.height; top += kBlock)
    for (int left = 0; left < mask.width; left += kBlock) {
      const int bottom = std::min(top + kBlock, mask.height), right = std::min(left + kBlock, mask.width);
      bool isFull = true;
      for (int y = top; isFull && y < bottom; ++y)
        for (int x = left; isFull && x < right; ++x) isFull = isInside(x, y);
      if (isFull && mesh.addQuad(left, top, right, bottom)) continue;
      for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x)
          if (isInside(x, y)) mesh.addQuad(x, y, x + 1, y + 1);
    }
  return mesh.take();
}

} // namespace surflect::relief
