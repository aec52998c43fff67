#include "bench/slf/synthetic_field.h"

#include "srf/image/half_float.h"
#include "surfel/math/space.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>

namespace surflect::bench {

namespace {

using slf::Chart;
using slf::Field;
using slf::Texel;

// Point of the bumpy sphere over a point of the cube |x|, |y|, |z| <= 1.
Vec3<double> bumpyPoint(const Vec3<double>& cube, const SyntheticOptions& options) {
  const Vec3<double> tangent = (cube.array() * (std::numbers::pi / 4)).tan(); // cells of nearly equal size
  const Vec3<double> d = tangent.normalized();
  const double bumps = std::sin(6 * d.x() + 1) * std::sin(5 * d.y() + 2) * std::sin(7 * d.z() + 0.5);
  return options.middle + (1 + options.bump * bumps) * d;
}

// Point of the cube at place (a, b), 0..1, of one of its faces; (a, b, outwards) is right-handed.
Vec3<double> cubePoint(int face, double a, double b) {
  const int axis = face % 3;
  const double sign = face < 3 ? 1 : -1;
  Vec3<double> cube;
  cube[axis] = sign;
  cube[(axis + 1) % 3] = sign * (2 * a - 1);
  cube[(axis + 2) % 3] = 2 * b - 1;
  return cube;
}

// Radiance at a point with a normal, towards unit direction r.
Vec3<double> radianceAt(const Vec3<double>& p, const Vec3<double>& n, const Vec3<double>& r) {
  const double pattern = 0.5 + 0.5 * std::sin(9 * p.x()) * std::sin(8 * p.y() + 1) * std::sin(7 * p.z());
  const Vec3<double> albedo(0.2 + 0.5 * pattern, 0.35, 0.6 - 0.4 * pattern);
  Vec3<double> radiance = 0.1 * albedo;
  for (const Vec3<double>& light :
       {Vec3<double>(1, 1, 1), Vec3<double>(-1, 0.3, 0.5), Vec3<double>(0.2, -1, -0.6)}) {
    const Vec3<double> l = light.normalized(), mirrored = 2 * n.dot(l) * n - l;
    const double cosine = std::max(0.0, n.dot(l));
    radiance += 0.5 * cosine * albedo;
    if (cosine > 0) radiance.array() += 0.35 * std::pow(std::max(0.0, mirrored.dot(r)), 12);
  }
  return radiance;
}

// Cell of a face of the cube.
struct Cell {
  int face = 0, row = 0, column = 0;
};

Vec3<double> pointOf(const Cell& cell, double u, double v, const SyntheticOptions& options) {
  return bumpyPoint(cubePoint(cell.face, (cell.column + u) / options.cells, (cell.row + v) / options.cells),
                    options);
}

struct SurfacePoint {
  Vec3<double> p, n;
};

// Points at the centres of a region's texels; the outermost are on its border.
std::vector<SurfacePoint> texelPoints(const Cell& cell, const SyntheticOptions& options) {
  constexpr double kStep = 1e-4;
  std::vector<SurfacePoint> points;
  for (int j = 0; j < options.texels; ++j)
    for (int i = 0; i < options.texels; ++i) {
      const double u = i / (options.texels - 1.0), v = j / (options.texels - 1.0);
      const Vec3<double> alongU = pointOf(cell, u + kStep, v, options) - pointOf(cell, u - kStep, v, options);
      const Vec3<double> alongV = pointOf(cell, u, v + kStep, options) - pointOf(cell, u, v - kStep, options);
      points.push_back({pointOf(cell, u, v, options) - options.middle, alongU.cross(alongV).normalized()});
    }
  return points;
}

// Vertices of the mesh by their place on the cube, so that cells share those of their borders.
class Vertices {
public:
  Vertices(const SyntheticOptions& options, TriangleMesh& mesh) : options_(options), mesh_(mesh) {}

  // Vertex at quad corner (i, j) of a cell.
  uint32_t at(const Cell& cell, int i, int j) {
    const int side = options_.cells * options_.quads; // quads along an edge of the cube
    const Vec3<double> cube =
        cubePoint(cell.face, static_cast<double>(cell.column * options_.quads + i) / side,
                  static_cast<double>(cell.row * options_.quads + j) / side);
    std::array<int, 3> place{};
    for (size_t axis = 0; axis < 3; ++axis)
      place[axis] = static_cast<int>(std::lround(cube[static_cast<Eigen::Index>(axis)] * side));
    const auto [found, isNew] = numbers_.try_emplace(place, static_cast<uint32_t>(mesh_.positions.size()));
    if (isNew)
      mesh_.positions.push_back(assume<Point3<AcquisitionSpace>>(
          bumpyPoint(Vec3<double>(place[0], place[1], place[2]) / side, options_)));
    return found->second;
  }

private:
  const SyntheticOptions& options_;
  TriangleMesh& mesh_;
  std::map<std::array<int, 3>, uint32_t> numbers_;
};

Chart chartOf(const Cell& cell, const SyntheticOptions& options, Vertices& vertices) {
  Chart chart;
  chart.width = chart.height = options.texels;
  const auto coordinate = [&](int k) {
    return static_cast<float>((0.5 + (options.texels - 1.0) * k / options.quads) / options.texels);
  };
  for (int j = 0; j <= options.quads; ++j)
    for (int i = 0; i <= options.quads; ++i) {
      chart.vertices.push_back(vertices.at(cell, i, j));
      chart.coordinates.emplace_back(coordinate(i), coordinate(j));
    }
  const auto at = [&](int i, int j) { return static_cast<uint32_t>(j * (options.quads + 1) + i); };
  for (int j = 0; j < options.quads; ++j)
    for (int i = 0; i < options.quads; ++i) {
      chart.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      chart.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return chart;
}

std::vector<Cell> cellsOf(const SyntheticOptions& options) {
  std::vector<Cell> cells;
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < options.cells; ++row)
      for (int column = 0; column < options.cells; ++column) cells.push_back({face, row, column});
  return cells;
}

} // namespace

Field syntheticField(const SyntheticOptions& options) {
  Field field;
  field.directionMeshes.emplace_back(slf::octahedronDirections(options.subdivisions));
  Vertices vertices(options, field.mesh);
  for (const Cell& cell : cellsOf(options)) {
    Chart chart = chartOf(cell, options, vertices);
    for (const auto& [a, b, c] : chart.triangles) {
      chart.meshTriangles.push_back(static_cast<uint32_t>(field.mesh.triangles.size()));
      field.mesh.triangles.push_back({chart.vertices[a], chart.vertices[b], chart.vertices[c]});
    }
    field.regions.push_back({std::move(chart), 0});
  }
  return field;
}

SyntheticTextures::SyntheticTextures(const Field& field, const SyntheticOptions& options)
    : texels_(field.regions.size()) {
  const std::vector<Cell> cells = cellsOf(options);
  tbb::parallel_for(size_t{0}, cells.size(), [&](size_t region) {
    const std::vector<SurfacePoint> points = texelPoints(cells[region], options);
    for (const slf::Direction& r : field.directionsOf(region).directions()) {
      std::vector<Texel>& texels = texels_[region].emplace_back();
      for (const auto& [p, n] : points) {
        const Vec3<float> value = radianceAt(p, n, r.raw()).cast<float>();
        texels.push_back({image::nearestHalf(value.x()), image::nearestHalf(value.y()),
                          image::nearestHalf(value.z()), image::nearestHalf(n.dot(r.raw()) > 0 ? 1.f : 0.f)});
      }
    }
  });
}

ConstantTextures::ConstantTextures(const Field& field, const std::array<float, 4>& value) : field_(&field) {
  for (size_t channel = 0; channel < 4; ++channel) texel_[channel] = image::nearestHalf(value[channel]);
}

std::vector<Texel> ConstantTextures::read(size_t region, size_t) const {
  return std::vector<Texel>(field_->regions[region].chart.texels(), texel_);
}

} // namespace surflect::bench
