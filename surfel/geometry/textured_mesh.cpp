#include "surfel/geometry/textured_mesh.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <deque>
#include <map>
#include <optional>
#include <span>

namespace surflect {

namespace {

using Point = Vec2<double>;

// Overlap of the fan's triangles, relative to the polygon's area, that rounding of corners can cause.
constexpr double kRounding = 1e-6;

// Twice the signed area. One rounding per product; exact for coordinates of similar magnitude.
double area(const Point& a, const Point& b, const Point& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

// Returns whether the fan around the first corner covers the polygon, so that no triangle is flipped.
bool isCoveredByFan(std::span<const Vec3<double>> corners, const Vec3<double>& normal) {
  double sum = 0, covered = 0; // areas times a common factor
  for (size_t i = 2; i < corners.size(); ++i) {
    const double part = normal.dot((corners[i - 1] - corners[0]).cross(corners[i] - corners[0]));
    sum += part;
    covered += std::abs(part);
  }
  return covered <= (1 + kRounding) * sum;
}

// Corners without the coordinate along which the normal is longest, counter-clockwise; coordinates are
// unchanged.
std::vector<Point> projected(std::span<const Vec3<double>> corners, const Vec3<double>& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  Eigen::Index u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  std::vector<Point> points;
  points.reserve(corners.size());
  for (const auto& p : corners) points.emplace_back(p[u], p[v]);
  return points;
}

// A counter-clockwise polygon whose ears are clipped one by one.
class Clipping {
public:
  Clipping(std::vector<Point> points, std::vector<std::array<uint32_t, 3>>& triangles)
      : points_(std::move(points)), triangles_(triangles), links_(points_.size()),
        left_(static_cast<uint32_t>(points_.size())) {
    const auto n = static_cast<uint32_t>(points_.size());
    for (uint32_t i = 0; i < n; ++i) links_[i] = {(i + n - 1) % n, (i + 1) % n, 0, true};
    for (uint32_t i = 0; i < n; ++i) {
      if (!isConvex(i)) blockers_.push_back(i);
      askLater(i);
    }
    std::ranges::sort(blockers_, {}, [&](uint32_t i) { return points_[i].x(); });
  }

  void run(const Progress& progress) {
    while (left_ > 3) {
      const std::optional<uint32_t> ear = nextEar(progress);
      clip(ear ? *ear : leastOfEars());
    }
    clip(someLeft_);
  }

private:
  struct Link {
    uint32_t before, next;
    uint32_t asked; // number of times that the corner was queued
    bool isLeft;
  };
  struct Question {
    uint32_t corner, asked;
  };

  double areaAt(uint32_t i) const {
    return area(points_[links_[i].before], points_[i], points_[links_[i].next]);
  }
  bool isConvex(uint32_t i) const { return areaAt(i) > 0; }

  // Clipping an ear affects only its neighbours [Meisters 1975]. They go to the end of the queue, so that
  // triangles do not all share a corner.
  void askLater(uint32_t i) { queue_.push_back({i, ++links_[i].asked}); }

  std::optional<uint32_t> nextEar(const Progress& progress) {
    while (!queue_.empty()) {
      progress.checkpoint();
      const Question question = queue_.front();
      queue_.pop_front();
      const Link& link = links_[question.corner];
      if (link.isLeft && link.asked == question.asked && isEar(question.corner)) return question.corner;
    }
    return std::nullopt;
  }

  // Fallback without an ear: a corner without area, such as a repeated one, or in a self-intersecting polygon
  // any convex one.
  uint32_t leastOfEars() const {
    uint32_t least = someLeft_;
    for (uint32_t i = links_[least].next, n = 1; n < left_; i = links_[i].next, ++n) {
      const double here = areaAt(i), there = areaAt(least);
      if (here >= 0 && (there < 0 || here < there)) least = i;
    }
    return least;
  }

  // Ear test: no other corner lies in the triangle or on its sides. A corner in the triangle implies a
  // non-convex one in it [Meisters 1975]; convex corners stay convex.
  bool isEar(uint32_t i) const {
    if (!isConvex(i)) return false;
    const Point &a = points_[links_[i].before], &b = points_[i], &c = points_[links_[i].next];
    const double low = std::min({a.x(), b.x(), c.x()}), high = std::max({a.x(), b.x(), c.x()});
    const auto x = [&](uint32_t k) { return points_[k].x(); };
    for (auto k = std::ranges::lower_bound(blockers_, low, {}, x); k != blockers_.end() && x(*k) <= high; ++k)
      if (*k != i && links_[*k].isLeft && !isConvex(*k) && blocks(*k, a, b, c)) return false;
    return true;
  }

  bool blocks(uint32_t k, const Point& a, const Point& b, const Point& c) const {
    const Point& p = points_[k];
    // At a seam to a hole, corners share positions. No side leads from an end of the diagonal into the
    // triangle and out again; one may lead from the ear's tip.
    if (p == a || p == c) return false;
    const auto isWithinAngle = [&](uint32_t q) {
      return area(a, b, points_[q]) > 0 && area(b, c, points_[q]) > 0;
    };
    if (p == b) return isWithinAngle(links_[k].before) || isWithinAngle(links_[k].next);
    return area(a, b, p) >= 0 && area(b, c, p) >= 0 && area(c, a, p) >= 0;
  }

  void clip(uint32_t i) {
    const auto [before, next, asked, isLeft] = links_[i];
    triangles_.push_back({before, i, next});
    links_[before].next = next;
    links_[next].before = before;
    links_[i].isLeft = false;
    someLeft_ = before;
    --left_;
    askLater(before);
    askLater(next);
  }

  std::vector<Point> points_;
  std::vector<std::array<uint32_t, 3>>& triangles_;
  std::vector<Link> links_;
  std::vector<uint32_t> blockers_; // corners that were not convex at first, by x
  std::deque<Question> queue_;     // candidate ears
  uint32_t left_, someLeft_ = 0;
};

} // namespace

Vec3<double> newellNormal(std::span<const Vec3<double>> corners) {
  Vec3<double> sum = Vec3<double>::Zero();
  for (size_t i = 2; i < corners.size(); ++i)
    sum += (corners[i - 1] - corners[0]).cross(corners[i] - corners[0]);
  return sum;
}

void appendTriangles(std::span<const Vec3<double>> corners, std::vector<std::array<uint32_t, 3>>& triangles,
                     const Progress& progress) {
  assert(corners.size() >= 3);
  const auto count = static_cast<uint32_t>(corners.size());
  const Vec3<double> normal = newellNormal(corners);
  if (count > 3 && normal.squaredNorm() > 0 && !isCoveredByFan(corners, normal)) {
    Clipping(projected(corners, normal), triangles).run(progress);
    return;
  }
  for (uint32_t i = 2; i < count; ++i) {
    progress.checkNowAndThen(i);
    triangles.push_back({0, i - 1, i});
  }
}

namespace {

using Corner = FaceList::Corner;

// Calls add(a, b, c) for every triangle, with indices of corners in the list.
template <class Add>
void forEachTriangle(const FaceList& list, Faces faces, const Progress& progress, const Add& add) {
  std::vector<Vec3<double>> places;
  std::vector<std::array<uint32_t, 3>> cut;
  for (size_t f = 0; f < list.faceCount(); ++f) {
    progress.checkNowAndThen(f);
    const size_t first = list.start[f], end = list.start[f + 1];
    if (faces == Faces::asFans || end - first == 3) {
      for (size_t i = first + 2; i < end; ++i) add(first, i - 1, i);
      continue;
    }
    places.clear();
    cut.clear();
    for (size_t i = first; i < end; ++i)
      places.push_back(list.positions[list.corners[i].vertex].cast<double>().raw());
    appendTriangles(places, cut, progress);
    for (const auto& [a, b, c] : cut) add(first + a, first + b, first + c);
  }
}

// Appends the corners of a face; drops attributes that some of them lack.
void appendCorners(std::span<const Corner> face, std::vector<Corner>& corners) {
  const auto allHave = [&](uint32_t Corner::*what) {
    return std::ranges::none_of(face, [&](const Corner& corner) { return corner.*what == FaceList::kNone; });
  };
  const bool allHaveTexture = allHave(&Corner::texture), allHaveNormal = allHave(&Corner::normal);
  for (Corner corner : face) {
    if (!allHaveTexture) corner.texture = FaceList::kNone;
    if (!allHaveNormal) corner.normal = FaceList::kNone;
    corners.push_back(corner);
  }
}

} // namespace

TriangleMesh meshOf(FaceList list, Faces faces, const Progress& progress) {
  TriangleMesh mesh;
  const auto vertex = [&](size_t corner) { return list.corners[corner].vertex; };
  forEachTriangle(list, faces, progress, [&](size_t a, size_t b, size_t c) {
    mesh.triangles.push_back({vertex(a), vertex(b), vertex(c)});
  });
  mesh.positions = std::move(list.positions);
  return mesh;
}

TexturedMesh texturedMeshOf(const FaceList& list, Faces faces, const Progress& progress) {
  std::vector<Corner> corners;
  for (size_t f = 0; f < list.faceCount(); ++f) {
    progress.checkNowAndThen(f);
    appendCorners(std::span(list.corners).subspan(list.start[f], list.start[f + 1] - list.start[f]), corners);
  }
  const auto anyHas = [&](uint32_t Corner::*what) {
    return std::ranges::any_of(corners,
                               [&](const Corner& corner) { return corner.*what != FaceList::kNone; });
  };
  const bool hasTexture = anyHas(&Corner::texture), hasNormals = anyHas(&Corner::normal);
  TexturedMesh textured;
  std::map<Corner, uint32_t> vertices;
  const auto vertexOf = [&](size_t index) {
    const Corner& corner = corners[index];
    const auto [found, isNew] = vertices.try_emplace(corner, static_cast<uint32_t>(textured.corner.size()));
    if (isNew) {
      textured.mesh.positions.push_back(list.positions[corner.vertex]);
      textured.corner.push_back(corner.vertex);
      if (hasTexture)
        textured.textureCoordinates.push_back(
            corner.texture == FaceList::kNone ? Vec2<double>(0, 0) : list.textureCoordinates[corner.texture]);
      if (hasNormals)
        textured.normals.push_back(corner.normal == FaceList::kNone ? Vec3<double>(0, 0, 0)
                                                                    : list.normals[corner.normal]);
    }
    return found->second;
  };
  forEachTriangle(list, faces, progress, [&](size_t a, size_t b, size_t c) {
    const uint32_t va = vertexOf(a), vb = vertexOf(b),
                   vc = vertexOf(c); // evaluated in this order, which numbers the vertices
    textured.mesh.triangles.push_back({va, vb, vc});
  });
  return textured;
}

} // namespace surflect
