#include "srf/relief/relief.h"

#include "srf/relief/frontal_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

namespace surflect {

namespace {

// Triangles between corners of pixels, each corner made when it is first asked for.
class CornerMesh {
public:
  // depthAt(corner x, corner y, image point) of the image plane.
  CornerMesh(const Camera<AcquisitionSpace>& camera,
             std::function<double(int, int, const Vec2<double>&)> depthAt)
      : lens_(camera.lens), worldFromCamera_(camera.cameraFromWorld.inverse()), depthAt_(std::move(depthAt)),
        index_(static_cast<size_t>(lens_.width + 1) * static_cast<size_t>(lens_.height + 1), kUnasked) {}

  // Pixels left <= x < right, top <= y < bottom; false where a corner has no ray.
  bool addQuad(int left, int top, int right, int bottom) {
    const std::array corners{corner(left, top), corner(left, bottom), corner(right, bottom),
                             corner(right, top)};
    if (std::ranges::count(corners, kNone) > 0) return false;
    mesh_.triangles.push_back({corners[0], corners[1], corners[2]});
    mesh_.triangles.push_back({corners[0], corners[2], corners[3]});
    return true;
  }
  TriangleMesh take() { return std::move(mesh_); }

private:
  static constexpr uint32_t kUnasked = 0xFFFFFFFF, kNone = 0xFFFFFFFE;

  uint32_t corner(int x, int y) {
    uint32_t& index =
        index_[static_cast<size_t>(y) * static_cast<size_t>(lens_.width + 1) + static_cast<size_t>(x)];
    if (index != kUnasked) return index;
    const auto q = imagePoint(lens_, {static_cast<double>(x), static_cast<double>(y)});
    if (!q) return index = kNone;
    index = static_cast<uint32_t>(mesh_.positions.size());
    mesh_.positions.push_back(worldFromCamera_(atDepth(lens_, *q, depthAt_(x, y, *q))).cast<float>());
    return index;
  }

  const Lens& lens_;
  Rigid<AcquisitionSpace, CameraSpace> worldFromCamera_;
  std::function<double(int, int, const Vec2<double>&)> depthAt_;
  std::vector<uint32_t> index_;
  TriangleMesh mesh_;
};

} // namespace

TriangleMesh reliefMesh(const Camera<AcquisitionSpace>& camera, const DepthMap& map) {
  const bool isPinhole = camera.lens.model == Lens::Model::pinhole;
  const auto index = [&](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(map.mask.width) + static_cast<size_t>(x);
  };
  // The mean of what the pixels around a corner make of it.
  CornerMesh mesh(camera, [&](int cornerX, int cornerY, const Vec2<double>& q) {
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

TriangleMesh planeMesh(const Camera<AcquisitionSpace>& camera, const Mask& mask) {
  constexpr int kBlock = 8;
  const double depth = frontalDepth(camera);
  CornerMesh mesh(camera, [&](int, int, const Vec2<double>&) { return depth; });
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

} // namespace surflect
