#include "render/lightfield/slf/direction_mesh.h"

#include "render/lightfield/common/convex_hull.h"
#include "surfel/base/error.h"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>

namespace surflect::slf {

namespace {

using Triangle = std::array<uint32_t, 3>;

// Directions nearer than this, in radians, count as equal.
constexpr double kDistinct = 1e-6;

double determinant(const Direction& a, const Direction& b, const Direction& c) {
  return a.raw().dot(b.raw().cross(c.raw()));
}

void requireDistinctUnits(std::span<const Direction> directions) {
  if (directions.size() < 4)
    throw Error::mismatch("at least 4", std::to_string(directions.size())).at("directions");
  for (size_t i = 0; i < directions.size(); ++i) {
    const std::string field = "directions[" + std::to_string(i) + ']';
    const double length = directions[i].raw().norm();
    if (!(std::abs(length - 1) < 1e-6))
      throw Error::mismatch("length 1", "length " + numberText(length)).at(field);
    for (size_t j = 0; j < i; ++j)
      if ((directions[i].raw() - directions[j].raw()).norm() < kDistinct)
        throw Error("equals directions[" + std::to_string(j) + ']').at(field);
  }
}

// Triangles of the convex hull of directions.
std::vector<Triangle> hullOf(std::span<const Direction> directions) {
  std::vector<Vec3<double>> points;
  for (const Direction& direction : directions) points.push_back(direction.raw());
  std::vector<Triangle> triangles = lightfield::convexHull(points);
  if (triangles.empty()) throw Error("lie in a plane").at("directions");
  return triangles;
}

// Solid angle of the cone of a triangle.  [Van Oosterom and Strackee 1983]
double solidAngle(const Direction& a, const Direction& b, const Direction& c) {
  return 2 * std::atan2(determinant(a, b, c), 1 + dot(a, b) + dot(b, c) + dot(c, a));
}

// Triangle across the edge opposite to each corner. Throws Error where there is none.
std::vector<Triangle> neighborsOf(std::span<const Triangle> triangles) {
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> triangleOfEdge; // from, to: as its triangle runs
  for (uint32_t t = 0; t < triangles.size(); ++t)
    for (size_t corner = 0; corner < 3; ++corner)
      triangleOfEdge[{triangles[t][(corner + 1) % 3], triangles[t][(corner + 2) % 3]}] = t;
  std::vector<Triangle> neighbors(triangles.size());
  for (size_t t = 0; t < triangles.size(); ++t)
    for (size_t corner = 0; corner < 3; ++corner) {
      const auto across =
          triangleOfEdge.find({triangles[t][(corner + 2) % 3], triangles[t][(corner + 1) % 3]});
      if (across == triangleOfEdge.end())
        throw Error("has an edge that no other triangle has").at("triangles[" + std::to_string(t) + ']');
      neighbors[t][corner] = across->second;
    }
  return neighbors;
}

} // namespace

DirectionMesh::DirectionMesh(std::vector<Direction> directions) : directions_(std::move(directions)) {
  requireDistinctUnits(directions_);
  triangles_ = hullOf(directions_);
  if (triangles_.size() != 2 * directions_.size() - 4) // Euler's formula; Qhull leaves out what is inside
    throw Error("too close to each other to be triangulated").at("directions");
  // The origin is strictly inside exactly if it is behind every face.
  for (Triangle& corners : triangles_) {
    const auto& [a, b, c] = corners;
    if (!(determinant(directions_[a], directions_[b], directions_[c]) > 1e-12))
      throw Error("lie in one hemisphere; a direction mesh must surround the sphere").at("directions");
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
  }
  std::ranges::sort(triangles_); // the same order whatever Qhull does
  neighbors_ = neighborsOf(triangles_);
}

DirectionMesh::DirectionMesh(std::vector<Direction> directions, std::vector<Triangle> triangles)
    : directions_(std::move(directions)), triangles_(std::move(triangles)) {
  requireDistinctUnits(directions_);
  double covered = 0;
  for (size_t t = 0; t < triangles_.size(); ++t) {
    const auto& [a, b, c] = triangles_[t];
    if (std::max({a, b, c}) >= directions_.size() ||
        !(determinant(directions_[a], directions_[b], directions_[c]) > 0))
      throw Error("is not counter-clockwise, seen from outside").at("triangles[" + std::to_string(t) + ']');
    covered += solidAngle(directions_[a], directions_[b], directions_[c]);
  }
  constexpr double kSphere = 4 * std::numbers::pi;
  if (!(std::abs(covered / kSphere - 1) < 1e-6))
    throw Error::mismatch("the sphere, once", numberText(covered / kSphere) + " of it").at("triangles");
  neighbors_ = neighborsOf(triangles_);
}

uint32_t DirectionMesh::triangleAt(const Direction& r, uint32_t start) const {
  assert(start < triangles_.size());
  // Crosses the edge that r is furthest behind; each step comes closer, so that the walk ends.
  uint32_t triangle = start;
  for (size_t step = 0; step <= triangles_.size(); ++step) {
    const Triangle& corners = triangles_[triangle];
    size_t across = 3;
    double furthest = 0;
    for (size_t corner = 0; corner < 3; ++corner) {
      const double side =
          determinant(r, directions_[corners[(corner + 1) % 3]], directions_[corners[(corner + 2) % 3]]);
      if (side < furthest) furthest = side, across = corner;
    }
    if (across == 3) break;
    triangle = neighbors_[triangle][across];
  }
  return triangle;
}

HatWeights DirectionMesh::weightsAt(const Direction& r, uint32_t start) const {
  HatWeights hats;
  hats.triangle = triangleAt(r, start);
  hats.directions = triangles_[hats.triangle];
  double sum = 0;
  for (size_t corner = 0; corner < 3; ++corner) {
    hats.weights[corner] = std::max(0.0, determinant(r, directions_[hats.directions[(corner + 1) % 3]],
                                                     directions_[hats.directions[(corner + 2) % 3]]));
    sum += hats.weights[corner];
  }
  for (double& weight : hats.weights) weight /= sum;
  return hats;
}

std::vector<Direction> octahedronDirections(int subdivisions) {
  std::vector<Direction> directions;
  for (const double sign : {1.0, -1.0})
    for (int axis = 0; axis < 3; ++axis)
      directions.push_back(assume<Direction>(sign * Vec3<double>::Unit(axis)));
  for (int level = 0; level < subdivisions; ++level) {
    // Every edge of the mesh gives its middle.
    const DirectionMesh mesh(directions);
    for (const Triangle& corners : mesh.triangles())
      for (size_t corner = 0; corner < 3; ++corner) {
        const uint32_t a = corners[corner], b = corners[(corner + 1) % 3];
        if (a < b) directions.push_back(normalized(mesh.directions()[a] + mesh.directions()[b]));
      }
  }
  return directions;
}

} // namespace surflect::slf
