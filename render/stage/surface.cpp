#include "render/stage/surface.h"

#include "surfel/base/error.h"
#include "warp/deform.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <map>
#include <string>
#include <utility>

namespace surflect::stage {

namespace {

using Vector = Vec3<double>;
using Direction = Direction3<AcquisitionSpace, double>;

// Moves one vertex by a map with Jacobian j. Returns whether the map mirrors.
bool carry(Surface& surface, size_t i, const Vector& position, const Mat3<double>& j) {
  // Cofactors det(J) J^-T, which exist also for singular J
  Mat3<double> cofactors;
  cofactors << j.col(1).cross(j.col(2)), j.col(2).cross(j.col(0)), j.col(0).cross(j.col(1));
  const bool mirrors = j.determinant() < 0;
  surface.mesh.positions[i] = assume<Point3<AcquisitionSpace>>(position);
  surface.normals[i] = assume<Direction>((mirrors ? -1. : 1.) * (cofactors * surface.normals[i].raw()));
  surface.tangents[i] = assume<Direction>(j * surface.tangents[i].raw());
  return mirrors;
}

std::string vertexName(size_t i) { return "vertex[" + std::to_string(i) + "]"; }

// First vertex with the same key, per vertex.
template <class KeyOf> std::vector<size_t> firstAlike(size_t vertices, KeyOf keyOf) {
  std::map<decltype(keyOf(size_t{0})), size_t> firsts;
  std::vector<size_t> first(vertices);
  for (size_t i = 0; i < vertices; ++i) first[i] = firsts.try_emplace(keyOf(i), i).first->second;
  return first;
}

} // namespace

void requireFewTriangles(size_t count) {
  if (count > kMostTriangles)
    throw Error::mismatch("at most " + std::to_string(kMostTriangles) + " triangles in all",
                          std::to_string(count) + " or more");
}

void requireVisible(const Surface& surface) {
  const TriangleMesh& mesh = surface.mesh;
  for (const auto& p : mesh.positions)
    if (!(p.raw().array().abs() <= kFarthest).all())
      throw Error::mismatch("a surface within 1e9 of 0",
                            fmt::format("a vertex at [{:.6g}, {:.6g}, {:.6g}]", p.x(), p.y(), p.z()));
  for (size_t i = 0; i < mesh.triangles.size(); ++i)
    if (areaVector(mesh, i).norm() > 0) return;
  throw Error::mismatch("a surface", "no triangle that has an area");
}

void append(Surface& surface, const Surface& other) {
  requireFewTriangles(surface.mesh.triangles.size() + other.mesh.triangles.size());
  const auto first = static_cast<uint32_t>(surface.mesh.positions.size());
  const auto add = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  add(surface.mesh.positions, other.mesh.positions);
  add(surface.normals, other.normals);
  add(surface.tangents, other.tangents);
  add(surface.textureCoordinates, other.textureCoordinates);
  for (const auto& [a, b, c] : other.mesh.triangles)
    surface.mesh.triangles.push_back({first + a, first + b, first + c});
}

Surface transformed(const Surface& surface, const Mat3<double>& linear, const Vec3<double>& offset) {
  Surface result = surface;
  bool mirrors = false;
  for (size_t i = 0; i < surface.mesh.positions.size(); ++i)
    mirrors = carry(result, i, linear * surface.mesh.positions[i].cast<double>().raw() + offset, linear);
  if (mirrors)
    for (auto& [a, b, c] : result.mesh.triangles) std::swap(b, c);
  return result;
}

Surface withTangentsTurned(const Surface& surface, Angle angle) {
  Surface result = surface;
  for (size_t i = 0; i < surface.normals.size(); ++i) {
    const Vector n = surface.normals[i].raw().stableNormalized(), t = surface.tangents[i].raw();
    result.tangents[i] =
        assume<Direction>(Vector(std::cos(angle.radians()) * t + std::sin(angle.radians()) * n.cross(t)));
  }
  return result;
}

Surface withPlanarTexture(const Surface& surface) {
  Eigen::AlignedBox2d bounds;
  const auto seen = [&](size_t i) {
    return Vec2<double>(surface.mesh.positions[i].cast<double>().raw().head<2>());
  };
  const size_t vertices = surface.mesh.positions.size();
  for (size_t i = 0; i < vertices; ++i) bounds.extend(seen(i));
  const double side = bounds.sizes().maxCoeff();
  Surface result = surface;
  result.textureCoordinates.clear();
  for (size_t i = 0; i < vertices; ++i)
    result.textureCoordinates.push_back(
        Vec2<double>((seen(i) - bounds.center()) / side + Vec2<double>(0.5, 0.5)));
  return result;
}

Surface displaced(const Surface& surface, const warp::Expression& height) {
  const size_t vertices = surface.mesh.positions.size();
  const auto place = [&](size_t i) {
    const auto& p = surface.mesh.positions[i];
    return std::array{p.x(), p.y(), p.z()};
  };
  const auto side = [&](size_t i) {
    const auto& n = surface.normals[i];
    return std::pair{place(i), std::array{n.x(), n.y(), n.z()}};
  };
  const std::vector<size_t> samePlace = firstAlike(vertices, place), sameSide = firstAlike(vertices, side);

  Surface result = surface;
  std::vector<Vector> outward(vertices, Vector::Zero());
  for (size_t i = 0; i < vertices; ++i) outward[samePlace[i]] += surface.normals[i].raw().stableNormalized();
  for (size_t i = 0; i < vertices; ++i) {
    const size_t k = samePlace[i];
    const Vector p = surface.mesh.positions[k].cast<double>().raw();
    const bool hasTexture = !surface.textureCoordinates.empty();
    const Vec2<double> st = hasTexture ? surface.textureCoordinates[k] : Vec2<double>(0, 0);
    const double h = height(std::array{p.x(), p.y(), p.z(), st.x(), st.y()});
    if (!(std::abs(h) < 1e9)) throw Error("the height has no value there").at(vertexName(k));
    result.mesh.positions[i] =
        assume<Point3<AcquisitionSpace>>(Vector(p + h * outward[k].stableNormalized()));
  }

  std::vector<Vector> sums(vertices, Vector::Zero());
  for (size_t i = 0; i < result.mesh.triangles.size(); ++i)
    for (const uint32_t corner : result.mesh.triangles[i])
      sums[sameSide[corner]] += areaVector(result.mesh, i);
  for (size_t i = 0; i < vertices; ++i) {
    const Vector n = sums[sameSide[i]].stableNormalized(), t = surface.tangents[i].raw();
    result.normals[i] = assume<Direction>(n);
    result.tangents[i] = assume<Direction>(Vector(t - t.dot(n) * n));
  }
  return result;
}

Surface deformed(const Surface& rest, const warp::Warp& warp) {
  SurfelCloud points;
  points.p0 = rest.mesh.positions;
  const double step = warp::differenceStep(points);
  Surface surface = rest;
  std::vector<char> mirrors(rest.mesh.positions.size());
  tbb::parallel_for(size_t{0}, rest.mesh.positions.size(), [&](size_t i) {
    const Vector x = rest.mesh.positions[i].cast<double>().raw();
    const auto exact = warp.jacobian(x);
    const Mat3<double> j = exact ? *exact : warp::centralDifferences(warp, x, Mat3<double>::Identity(), step);
    mirrors[i] = carry(surface, i, warp.position(x), j);
    if (!surface.mesh.positions[i].raw().allFinite() || !j.allFinite())
      throw Error("the warp has no value there").at(vertexName(i));
  });
  for (auto& [a, b, c] : surface.mesh.triangles)
    if (mirrors[a]) std::swap(b, c);
  return surface;
}

} // namespace surflect::stage
