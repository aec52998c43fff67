#include "render/lightfield/olf/reference.h"

#include "render/lightfield/lfm/s3tc.h"
#include "render/lightfield/lfm/tile.h"
#include "srf/image/half_float.h"

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

namespace surflect::olf {

namespace {

bool isBefore(const FrontHit& a, const FrontHit& b) {
  return std::tie(a.distance, a.triangle) < std::tie(b.distance, b.triangle);
}

// Front of a triangle along a ray; empty if the ray misses it or meets its back.
std::optional<FrontHit> met(const std::array<Vec3<double>, 3>& corners, uint32_t triangle,
                            const Vec3<double>& origin, const Vec3<double>& direction) {
  const Vec3<double> e1 = corners[1] - corners[0], e2 = corners[2] - corners[0], p = direction.cross(e2);
  const double determinant = e1.dot(p);
  if (!(determinant > 0)) return std::nullopt;
  const Vec3<double> t = origin - corners[0], q = t.cross(e1);
  const double b = t.dot(p) / determinant, c = direction.dot(q) / determinant,
               distance = e2.dot(q) / determinant;
  if (!(b >= 0 && c >= 0 && b + c <= 1 && distance > 0)) return std::nullopt;
  return FrontHit{distance, triangle, {1 - b - c, b, c}};
}

struct Box {
  int x0, y0, x1, y1; // pixels [x0, x1) x [y0, y1)
};

Box boxOf(const std::array<Vec3<double>, 3>& corners, const capture::Camera<AcquisitionSpace>& camera) {
  Box box{camera.lens.width, camera.lens.height, 0, 0};
  for (const Vec3<double>& corner : corners) {
    const auto pixel = camera.project(assume<Point3<AcquisitionSpace, double>>(corner));
    if (!pixel) return {0, 0, camera.lens.width, camera.lens.height};
    const double x = std::clamp(pixel->x, -1.0, camera.lens.width + 1.0),
                 y = std::clamp(pixel->y, -1.0, camera.lens.height + 1.0);
    box = {std::min(box.x0, std::max(0, static_cast<int>(x) - 1)),
           std::min(box.y0, std::max(0, static_cast<int>(y) - 1)),
           std::max(box.x1, std::min(camera.lens.width, static_cast<int>(x) + 2)),
           std::max(box.y1, std::min(camera.lens.height, static_cast<int>(y) + 2))};
  }
  return box;
}

// Stored texel (i, j) of a view.
Eigen::Vector4d storedTexel(const PackedViews& packed, size_t view, int i, int j) {
  const auto x = static_cast<size_t>(i), y = static_cast<size_t>(j),
             width = static_cast<size_t>(packed.width);
  Eigen::Vector4d value;
  if (packed.isCompressed()) {
    constexpr size_t kSide = lfm::kBlockSide, kBytes = lfm::blockBytes(lfm::Blocks::dxt5);
    const auto block =
        packed.layerBlocks(view).subspan(kBytes * (y / kSide * (width / kSide) + x / kSide), kBytes);
    const std::array<uint8_t, 4> bytes =
        lfm::s3tcTexel(block, y % kSide * kSide + x % kSide, lfm::Blocks::dxt5);
    for (size_t c = 0; c < 4; ++c) value[static_cast<Eigen::Index>(c)] = bytes[c] / 255.0;
  } else {
    const Texel& halves = packed.layer(view)[y * width + x];
    for (size_t c = 0; c < 4; ++c)
      value[static_cast<Eigen::Index>(c)] = static_cast<double>(image::floatOfHalf(halves[c]));
  }
  return value;
}

} // namespace

Eigen::Vector4d texelAt(const PackedViews& packed, size_t view, const capture::Pixel& pixel) {
  const PackedView& place = packed.views[view];
  const double x = std::clamp(place.scale[0] * (pixel.x - place.low[0]), 0.5, place.width - 0.5) - 0.5,
               y = std::clamp(place.scale[1] * (pixel.y - place.low[1]), 0.5, place.height - 0.5) - 0.5;
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, place.width - 1), y1 = std::min(y0 + 1, place.height - 1);
  const auto texel = [&](int i, int j) { return storedTexel(packed, view, i, j); };
  const double u = x - x0, v = y - y0;
  Eigen::Vector4d value = (1 - v) * ((1 - u) * texel(x0, y0) + u * texel(x1, y0)) +
                          v * ((1 - u) * texel(x0, y1) + u * texel(x1, y1));
  if (packed.isCompressed())
    value.head<3>() = value[3] * static_cast<double>(place.white) * value.head<3>().cwiseAbs2();
  return value;
}

Eigen::Vector4d blendAt(const OpacityField& field, const TriangleBlend& blend, const Vec3<double>& point,
                        const Vec3<double>& barycentric) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (size_t k = 0; k < blend.count; ++k) {
    double weight = 0;
    for (size_t corner = 0; corner < 3; ++corner)
      weight +=
          barycentric[static_cast<Eigen::Index>(corner)] * static_cast<double>(blend.weights[corner][k]);
    const size_t view = blend.views[k];
    const auto pixel = field.cameras[view].project(assume<Point3<AcquisitionSpace, double>>(point));
    if (pixel) sum += weight * texelAt(field.packed, view, *pixel);
  }
  return sum;
}

ReferencePicture
composited(const TriangleMesh& mesh, const capture::Camera<AcquisitionSpace>& camera,
           const std::function<Eigen::Vector4d(const FrontHit& hit, const Vec3<double>& direction)>& colorOf,
           Composite& composite) {
  const int width = camera.lens.width, height = camera.lens.height;
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const Vec3<double> origin = camera.center().raw();
  std::vector<Vec3<double>> directions;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      directions.push_back(
          worldFromCamera(capture::rayThrough(camera.lens, {x + 0.5, y + 0.5})->direction).raw());
  std::vector<std::vector<FrontHit>> hits(directions.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<Vec3<double>, 3> corners;
    for (size_t i = 0; i < 3; ++i) corners[i] = mesh.positions[mesh.triangles[t][i]].cast<double>().raw();
    const Box box = boxOf(corners, camera);
    for (int y = box.y0; y < box.y1; ++y)
      for (int x = box.x0; x < box.x1; ++x) {
        const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
        if (const auto hit = met(corners, t, origin, directions[pixel])) hits[pixel].push_back(*hit);
      }
  }
  ReferencePicture picture{image::Image(width, height, 4), 0};
  for (const auto& ofPixel : hits) picture.mostLayers = std::max(picture.mostLayers, ofPixel.size());
  tbb::parallel_for(size_t{0}, hits.size(), [&](size_t pixel) {
    std::ranges::sort(hits[pixel], isBefore);
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (const FrontHit& hit : hits[pixel]) sum = composite(sum, colorOf(hit, directions[pixel]));
    for (size_t c = 0; c < 4; ++c)
      picture.color.values[4 * pixel + c] = static_cast<float>(sum[static_cast<Eigen::Index>(c)]);
  });
  return picture;
}

ReferencePicture referencePicture(const OpacityField& field, const ViewBlender& blender,
                                  const capture::Camera<AcquisitionSpace>& camera, Composite& composite) {
  const Vec3<double> origin = camera.center().raw();
  const std::vector<TriangleBlend> blends = blender.blends(origin);
  const auto colorOf = [&](const FrontHit& hit, const Vec3<double>& direction) {
    return blendAt(field, blends[hit.triangle], origin + hit.distance * direction, hit.barycentric);
  };
  return composited(field.mesh, camera, colorOf, composite);
}

ReferencePicture referencePicture(const OpacityMaps& maps, const capture::Camera<AcquisitionSpace>& camera,
                                  std::optional<size_t> terms) {
  const OpacityMaps plain{lfm::decoded(maps.maps), maps.white, maps.order};
  const lfm::EdgeCorrections edges = lfm::edgeCorrections(plain.maps);
  return composited(plain.maps.mesh, camera, [&](const FrontHit& hit, const Vec3<double>& direction) {
    const lfm::TrianglePlace place{hit.triangle, hit.barycentric[1], hit.barycentric[2]};
    return colorAt(plain, place, assume<lfm::Direction>(Vec3<double>(-direction.normalized())),
                   terms.value_or(lfm::kMostTerms), edges);
  });
}

} // namespace surflect::olf
