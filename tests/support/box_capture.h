// Captures of boxes with a closed-form radiance under fixed light, and exact charts of their faces.
#pragma once

#include "render/lightfield/slf/chart.h"
#include "srf/capture/writer.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/rgb.h"
#include "tests/support/synthetic_capture.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace surflect::boxes {

// Radiance that leaves a place towards the viewer; both in acquisition space, `towards` is unit.
using RadianceAt = std::function<Rgb(const Vec3<double>& place, const Vec3<double>& towards)>;

// Appends an axis-parallel box of 8 vertices and 12 triangles that face outwards.
inline void addBox(TriangleMesh& mesh, const Vec3<float>& low, const Vec3<float>& high) {
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  for (uint32_t corner = 0; corner < 8; ++corner)
    mesh.positions.emplace_back(corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1],
                                corner & 4 ? high[2] : low[2]);
  constexpr std::array<std::array<uint32_t, 4>, 6> kFaces{
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& [a, b, c, d] : kFaces) {
    mesh.triangles.push_back({first + a, first + b, first + c});
    mesh.triangles.push_back({first + a, first + c, first + d});
  }
}

inline TriangleMesh unitCube() {
  TriangleMesh mesh;
  addBox(mesh, {-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f});
  return mesh;
}

// One chart of side x side texels for each face of the boxes; the corners of a face are centres of texels.
inline std::vector<slf::Chart> faceCharts(const TriangleMesh& mesh, int side) {
  std::map<std::array<long, 4>, std::vector<uint32_t>> faces; // by normal and plane
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3<double> n = areaVector(mesh, t).normalized();
    const Vec3<double> p = mesh.positions[mesh.triangles[t][0]].raw().cast<double>();
    faces[{std::lround(n[0]), std::lround(n[1]), std::lround(n[2]), std::lround(1e3 * n.dot(p))}].push_back(
        t);
  }
  std::vector<slf::Chart> charts;
  for (const auto& [plane, triangles] : faces) {
    slf::Chart& chart = charts.emplace_back();
    chart.width = chart.height = side;
    const Eigen::Index axis = plane[0] != 0 ? 0 : plane[1] != 0 ? 1 : 2;
    Eigen::Index right = (axis + 1) % 3, up = (axis + 2) % 3;
    if (plane[static_cast<size_t>(axis)] < 0) std::swap(right, up);
    std::map<uint32_t, uint32_t> local;
    for (const uint32_t t : triangles) {
      std::array<uint32_t, 3> corners{};
      for (size_t corner = 0; corner < 3; ++corner) {
        const uint32_t vertex = mesh.triangles[t][corner];
        const auto [place, isNew] = local.try_emplace(vertex, static_cast<uint32_t>(chart.vertices.size()));
        if (isNew) chart.vertices.push_back(vertex);
        corners[corner] = place->second;
      }
      chart.triangles.push_back(corners);
      chart.meshTriangles.push_back(t);
    }
    Eigen::AlignedBox3f box;
    for (const uint32_t vertex : chart.vertices) box.extend(mesh.positions[vertex].raw());
    for (const uint32_t vertex : chart.vertices) {
      const Vec3<float> share =
          (mesh.positions[vertex].raw() - box.min()).cwiseQuotient(box.sizes().cwiseMax(1e-9f));
      const auto inside = [side](float x) {
        return (0.5f + x * static_cast<float>(side - 1)) / static_cast<float>(side);
      };
      chart.coordinates.emplace_back(inside(share[right]), inside(share[up]));
    }
  }
  return charts;
}

struct Shoot {
  std::vector<Vec3<double>> from; // directions of the cameras, which look at the origin from distance 4
  int size = 64;                  // of pictures, pixels
  double halfAngle = 0.3;         // of the field of view, radians
  std::function<capture::Split(size_t view)> split = [](size_t) { return capture::Split::train; };
};

// Writes transforms.json, mesh.ply and one EXR a camera with one ray per pixel.
inline void writeCapture(const TriangleMesh& mesh, const RadianceAt& radianceAt, const Shoot& shoot,
                         const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::ofstream ply(folder / "mesh.ply");
  ply << "ply\nformat ascii 1.0\nelement vertex " << mesh.positions.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << mesh.triangles.size()
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& p : mesh.positions) ply << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const auto& [a, b, c] : mesh.triangles) ply << "3 " << a << ' ' << b << ' ' << c << '\n';
  ply.close();
  capture::Capture capture;
  capture.file = folder / "transforms.json";
  capture.colorSpace = capture::ColorSpace::linear;
  capture.geometry = "mesh.ply";
  const RayCaster<AcquisitionSpace> rays(mesh);
  for (const Vec3<double>& direction : shoot.from) {
    const size_t v = capture.views.size();
    auto camera = studio::cameraFrom<AcquisitionSpace>(direction, shoot.size);
    camera.lens.focalX = camera.lens.focalY = shoot.size / 2.0 / std::tan(shoot.halfAngle);
    capture.views.push_back({studio::numbered("C", v), camera});
    image::Image radiance(shoot.size, shoot.size, 3), alpha(shoot.size, shoot.size, 1);
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    for (int y = 0; y < shoot.size; ++y)
      for (int x = 0; x < shoot.size; ++x) {
        const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
        const auto origin = worldFromCamera(ray->origin);
        const auto towards = worldFromCamera(ray->direction);
        const auto hit = rays.firstHit(origin, towards);
        if (!hit) continue;
        const Rgb color = radianceAt(origin.raw() + hit->distance * towards.raw(), -towards.raw());
        std::ranges::copy(std::array{color.r, color.g, color.b}, radiance.at(x, y).begin());
        alpha.at(x, y)[0] = 1;
      }
    capture::Frame frame;
    frame.view = v;
    frame.picture = studio::numbered("C", v) + ".exr";
    frame.layer = "L";
    frame.alphaLayer = "matte";
    frame.split = shoot.split(v);
    capture::writeViewPictures(folder / frame.picture, std::vector<capture::RadianceLayer>{{"L", &radiance}},
                               &alpha, "matte");
    capture.frames.push_back(frame);
  }
  capture::writeCapture(capture, folder);
}

} // namespace surflect::boxes
