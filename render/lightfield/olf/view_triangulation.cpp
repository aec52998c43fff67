#include "render/lightfield/olf/view_triangulation.h"

#include "render/lightfield/lfm/view_blend.h"
#include "render/lightfield/olf/delaunay.h"

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

namespace surflect::olf {

namespace {

using Point = Point3<AcquisitionSpace, double>;

enum class Sighting : uint8_t { hidden, held, seen }; // held: in the picture, but not seen

// Barycentrics of the points that are tried: slightly inside, so that neighbours do not occlude them.
constexpr double kNear = 0.04;
constexpr std::array<std::array<double, 3>, 7> kTried{{{1.0 / 3, 1.0 / 3, 1.0 / 3},
                                                       {1 - 2 * kNear, kNear, kNear},
                                                       {kNear, 1 - 2 * kNear, kNear},
                                                       {kNear, kNear, 1 - 2 * kNear},
                                                       {kNear, 0.5 - kNear / 2, 0.5 - kNear / 2},
                                                       {0.5 - kNear / 2, kNear, 0.5 - kNear / 2},
                                                       {0.5 - kNear / 2, 0.5 - kNear / 2, kNear}}};

Sighting sightingOf(const TriangleMesh& mesh, size_t triangle,
                    const capture::Camera<AcquisitionSpace>& camera,
                    const RayCaster<AcquisitionSpace>& rays) {
  const Point center = camera.center();
  std::array<Vec3<double>, 3> corners;
  for (size_t i = 0; i < 3; ++i) {
    const Point p = mesh.positions[mesh.triangles[triangle][i]].cast<double>();
    const auto pixel = camera.project(p);
    if (!pixel || !capture::contains(camera.lens, *pixel)) return Sighting::hidden;
    corners[i] = p.raw();
  }
  if (!(areaVector(mesh, triangle).dot(center.raw() - corners[0]) > 0)) return Sighting::held;
  for (const auto& [a, b, c] : kTried) {
    const Point p = assume<Point>(Vec3<double>(a * corners[0] + b * corners[1] + c * corners[2]));
    const auto towards = center - p;
    if (rays.occluded(p, normalized(towards), rays.selfHitOffset(), length(towards))) return Sighting::held;
  }
  return Sighting::seen;
}

} // namespace

VisibleViews visibleViews(const lightfield::Views& views, std::span<const size_t> training,
                          const lfm::Rings& rings, Visible rule, const Progress& progress) {
  const TriangleMesh& mesh = views.mesh();
  std::vector<std::vector<uint32_t>> seen(mesh.positions.size()), facing(mesh.positions.size());
  std::vector<Sighting> sightings(mesh.triangles.size());
  for (uint32_t view = 0; view < training.size(); ++view) {
    progress("visible views", static_cast<double>(view) / static_cast<double>(training.size()));
    const capture::Camera<AcquisitionSpace>& camera = views.camera(training[view]);
    tbb::parallel_for(size_t{0}, sightings.size(),
                      [&](size_t t) { sightings[t] = sightingOf(mesh, t, camera, views.rays()); });
    for (const uint32_t vertex : rings.vertices()) {
      bool isHeld = true, isSeen = true;
      for (const lfm::RingTriangle& around : rings.around(vertex)) {
        isHeld &= sightings[around.triangle] != Sighting::hidden;
        isSeen &= sightings[around.triangle] == Sighting::seen;
      }
      if (isHeld && (isSeen || rule == Visible::all)) seen[vertex].push_back(view);
      const Vec3<double> towards = camera.center().raw() - mesh.positions[vertex].cast<double>().raw();
      if (isHeld && rings.frame(vertex).z.dot(towards) > 0) facing[vertex].push_back(view);
    }
  }
  VisibleViews visible;
  visible.first.push_back(0);
  std::vector<uint8_t> isUsed(mesh.positions.size(), 0);
  for (const uint32_t vertex : rings.vertices()) isUsed[vertex] = 1;
  for (size_t vertex = 0; vertex < seen.size(); ++vertex) {
    std::vector<uint32_t>& of = seen[vertex];
    if (of.empty() && isUsed[vertex]) {
      ++visible.unseenVertices;
      of = std::move(facing[vertex]);
      if (of.empty()) {
        of.resize(training.size());
        std::iota(of.begin(), of.end(), 0u);
      }
    }
    visible.views.insert(visible.views.end(), of.begin(), of.end());
    visible.first.push_back(static_cast<uint32_t>(visible.views.size()));
  }
  return visible;
}

ClosestViews ulrViews(std::span<const double> penalties) {
  // Makes the weight of an exactly met view 1.
  constexpr double kFloor = 1e-14;
  constexpr size_t kNearest = ClosestViews::kMost + 1;
  std::array<uint32_t, kNearest> nearest{};
  size_t count = 0;
  for (uint32_t i = 0; i < penalties.size(); ++i) {
    if (count == kNearest && !(penalties[i] < penalties[nearest[count - 1]])) continue;
    size_t at = count < kNearest ? count++ : count - 1;
    for (; at > 0 && penalties[nearest[at - 1]] > penalties[i]; --at) nearest[at] = nearest[at - 1];
    nearest[at] = i;
  }
  ClosestViews closest;
  if (count == 0) return closest;
  const size_t blended = count < 3 ? count : count - 1;
  const double threshold = count < 3 ? 1 : penalties[nearest[count - 1]]; // p_k
  double sum = 0;
  for (size_t i = 0; i < blended; ++i) {
    const double p = std::max(penalties[nearest[i]], kFloor);
    const double r = std::max(0.0, threshold - p) / p; // Eq. 4
    closest.push({nearest[i], r});
    sum += r;
  }
  if (sum > 0)
    for (WeightedView& view : closest) view.weight /= sum;
  else
    closest.begin()->weight = 1;
  return closest;
}

namespace {

double determinant(const Vec3<double>& a, const Vec3<double>& b, const Vec3<double>& c) {
  return a.dot(b.cross(c));
}

// Rounding of weights whose sum is one.
constexpr double kInside = -1e-12;

} // namespace

Vec3<double> ViewTriangulation::placed(const Vec3<double>& direction) const {
  if (domain_ == Domain::sphere) return direction;
  lfm::DiscPoint p(direction.dot(frame_.x), direction.dot(frame_.y));
  if (direction.dot(frame_.z) < 0) { // on the rim
    const double length = p.norm();
    p = length > 0 ? lfm::DiscPoint(p / length) : lfm::DiscPoint(1, 0);
  }
  return {p[0], p[1], 1};
}

lfm::DiscPoint ViewTriangulation::flattened(const Vec3<double>& placed) const {
  if (domain_ == Domain::plane) return placed.head<2>();
  const double depth = std::max(1 + placed.dot(frame_.z), 1e-3);
  return {placed.dot(frame_.x) / depth, placed.dot(frame_.y) / depth};
}

ViewTriangulation::ViewTriangulation(std::span<const Vec3<double>> directions, const lfm::VertexFrame& frame,
                                     Domain domain)
    : domain_(domain), frame_(frame) {
  assert(directions.size() <= kMostViews);
  const auto isUsed = [&](size_t i) { return domain == Domain::sphere || directions[i].dot(frame.z) >= 0; };
  for (size_t i = 0; i < directions.size(); ++i)
    if (isUsed(i)) views_.push_back(static_cast<Index>(i));
  views_.shrink_to_fit();
  sites_.reserve(views_.size());
  for (const Index view : views_) sites_.push_back(placed(directions[view]));
  if (domain == Domain::sphere) {
    for (const Vec3<double>& site : sites_) center_ += site;
    center_ = center_.norm() > 1e-6 ? Vec3<double>(center_.normalized()) : frame.z;
    frame_ = lfm::frameAlong(center_);
  }
  if (sites_.size() < 3) return;
  std::vector<lfm::DiscPoint> points;
  for (const Vec3<double>& site : sites_) points.push_back(flattened(site));
  const auto index = [](auto site) { return static_cast<Index>(site); };
  for (const auto& [corners, neighbors] : delaunay(points)) {
    Triangle& triangle = triangles_.emplace_back();
    for (size_t i = 0; i < 3; ++i) {
      triangle.corners[i] = index(corners[i]);
      triangle.neighbors[i] = neighbors[i] == DelaunayTriangle::kNone ? kNone : index(neighbors[i]);
      if (triangle.neighbors[i] == kNone)
        borders_.push_back({index(corners[(i + 1) % 3]), index(corners[(i + 2) % 3])});
    }
  }
  triangles_.shrink_to_fit();
  if (triangles_.empty()) {
    for (const auto& [from, to] : lfm::siteMesh(points).borders) borders_.push_back({index(from), index(to)});
    return;
  }
  if (domain == Domain::plane) { // centroid of the area
    double sum = 0;
    for (const Triangle& triangle : triangles_) {
      const auto& [a, b, c] = triangle.corners;
      const double area = lfm::doubledArea(points[a], points[b], points[c]);
      center_ += area / 3 * (sites_[a] + sites_[b] + sites_[c]);
      sum += area;
    }
    center_ /= sum;
  }
  fillCells(points);
}

void ViewTriangulation::fillCells(std::span<const lfm::DiscPoint> sites) {
  Eigen::AlignedBox2d box;
  for (const lfm::DiscPoint& site : sites) box.extend(site);
  constexpr double kTriangles = 4; // of a cell, nearly
  cellsAlong_ =
      static_cast<size_t>(std::ceil(std::sqrt(static_cast<double>(triangles_.size()) / kTriangles)));
  low_ = box.min();
  cellSize_ = box.sizes() / static_cast<double>(cellsAlong_);
  starts_.resize(cellsAlong_ * cellsAlong_);
  size_t triangle = 0;
  for (size_t y = 0; y < cellsAlong_; ++y)
    for (size_t step = 0; step < cellsAlong_; ++step) {
      const size_t x = y % 2 == 0 ? step : cellsAlong_ - 1 - step; // next to the last cell
      const lfm::DiscPoint middle(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
      triangle = walkTo(raised(low_ + middle.cwiseProduct(cellSize_)), triangle).triangle;
      starts_[y * cellsAlong_ + x] = static_cast<Index>(triangle);
    }
}

size_t ViewTriangulation::cellOf(const lfm::DiscPoint& p) const {
  const auto along = [&](Eigen::Index axis) {
    const double cell = (p[axis] - low_[axis]) / cellSize_[axis];
    return static_cast<size_t>(std::clamp(cell, 0.0, static_cast<double>(cellsAlong_ - 1)));
  };
  return along(1) * cellsAlong_ + along(0);
}

Vec3<double> ViewTriangulation::raised(const lfm::DiscPoint& p) const {
  if (domain_ == Domain::plane) return {p[0], p[1], 1};
  const double squared = p.squaredNorm();
  return (2 * p[0] * frame_.x + 2 * p[1] * frame_.y + (1 - squared) * frame_.z) / (1 + squared);
}

ViewTriangulation::Walk ViewTriangulation::walkTo(const Vec3<double>& d, size_t from) const {
  Walk walk{from};
  for (size_t step = 0; step < triangles_.size(); ++step) {
    const Triangle& triangle = triangles_[walk.triangle];
    walk.weights = weightsIn(triangle.corners, d);
    Eigen::Index worst = 0;
    const double least = walk.weights.minCoeff(&worst);
    walk.isInside = least >= kInside * walk.weights.cwiseAbs().sum();
    if (walk.isInside) break;
    const Index next = triangle.neighbors[static_cast<size_t>(worst)];
    if (next == kNone) break;
    walk.triangle = next;
  }
  return walk;
}

Vec3<double> ViewTriangulation::weightsIn(const Corners& corners, const Vec3<double>& d) const {
  const Vec3<double>&a = sites_[corners[0]], &b = sites_[corners[1]], &c = sites_[corners[2]];
  return {determinant(d, b, c), determinant(a, d, c), determinant(a, b, d)};
}

ClosestViews ViewTriangulation::inTriangle(const Corners& corners, const Vec3<double>& weights) const {
  const Vec3<double> positive = weights.cwiseMax(0.0);
  ClosestViews closest;
  for (size_t i = 0; i < 3; ++i)
    closest.push({views_[corners[i]], positive[static_cast<Eigen::Index>(i)] / positive.sum()});
  return closest;
}

ClosestViews ViewTriangulation::outside(const Vec3<double>& d) const {
  double best = -std::numeric_limits<double>::infinity();
  ClosestViews closest;
  for (const auto& [a, b] : borders_) {
    const double ofA = determinant(d, sites_[b], center_), ofB = determinant(sites_[a], d, center_);
    const double sum = ofA + ofB, least = std::min(ofA, ofB);
    if (!(sum > 0) || !(least / sum > best)) continue;
    best = least / sum;
    const double share = std::clamp(ofA / sum, 0.0, 1.0);
    closest = {};
    closest.push({views_[a], share});
    closest.push({views_[b], 1 - share});
  }
  return closest.size() > 0 ? closest : byDistance(d);
}

ClosestViews ViewTriangulation::alongLine(const Vec3<double>& d) const {
  const lfm::DiscPoint p = flattened(d);
  double nearest = std::numeric_limits<double>::infinity();
  ClosestViews closest;
  for (const auto& [a, b] : borders_) {
    const lfm::DiscPoint from = flattened(sites_[a]), along = flattened(sites_[b]) - from;
    const double squared = along.squaredNorm();
    const double share = squared > 0 ? std::clamp((p - from).dot(along) / squared, 0.0, 1.0) : 0;
    const double distance = (p - from - share * along).squaredNorm();
    if (!(distance < nearest)) continue;
    nearest = distance;
    closest = {};
    closest.push({views_[a], 1 - share});
    closest.push({views_[b], share});
  }
  return closest;
}

ClosestViews ViewTriangulation::byDistance(const Vec3<double>& d) const {
  std::vector<std::pair<double, uint32_t>> order; // distances and sites
  for (uint32_t i = 0; i < sites_.size(); ++i) order.emplace_back((sites_[i] - d).norm(), i);
  std::ranges::sort(order);
  ClosestViews closest;
  if (order.empty()) return closest;
  // Two views at most come here, but for the one direction that is opposite to x.
  const size_t count = std::min<size_t>(order.size(), sites_.size() < 3 ? 2 : 1);
  double sum = 0;
  for (size_t i = 0; i < count; ++i) sum += 1 / std::max(order[i].first, 1e-14);
  for (size_t i = 0; i < count; ++i)
    closest.push({views_[order[i].second], 1 / std::max(order[i].first, 1e-14) / sum});
  return closest;
}

ClosestViews ViewTriangulation::at(const Vec3<double>& direction) const {
  const Vec3<double> d = placed(direction);
  if (sites_.size() < 3) return byDistance(d);
  if (triangles_.empty()) return alongLine(d);
  const Walk walk = walkTo(d, starts_[cellOf(flattened(d))]);
  if (walk.isInside) return inTriangle(triangles_[walk.triangle].corners, walk.weights);
  // A border that is not convex can end a walk too early.
  for (const auto& [corners, neighbors] : triangles_) {
    const Vec3<double> weights = weightsIn(corners, d);
    if (weights.minCoeff() >= kInside * weights.cwiseAbs().sum()) return inTriangle(corners, weights);
  }
  return outside(d);
}

size_t ViewTriangulation::bytes() const {
  return sizeof(ViewTriangulation) + views_.size() * sizeof(Index) + sites_.size() * sizeof(Vec3<double>) +
         triangles_.size() * sizeof(Triangle) + borders_.size() * sizeof(borders_[0]) +
         starts_.size() * sizeof(Index);
}

} // namespace surflect::olf
