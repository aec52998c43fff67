#include "render/lightfield/olf/bsp_tree.h"

#include "surfel/math/bounds.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <utility>

namespace surflect::olf {

namespace {

struct Plane {
  Vec3<double> normal = Vec3<double>::Zero();
  double offset = 0;

  bool operator==(const Plane&) const = default;
};

struct Corner {
  Vec3<double> position, barycentric;
};

// Part of a triangle, a convex polygon, and the plane of its triangle: that of a sliver would be uncertain.
struct Facet {
  uint32_t triangle = 0;
  Plane plane;
  std::vector<Corner> corners;
  Vec3<double> center = Vec3<double>::Zero();
  double radius = 0; // from the centre to the farthest corner

  void fit() {
    for (const Corner& corner : corners) center += corner.position / static_cast<double>(corners.size());
    for (const Corner& corner : corners) radius = std::max(radius, (corner.position - center).norm());
  }
};

// Height of a point above a plane; 0 within the tolerance.
double heightOf(const Vec3<double>& point, const Plane& plane, double tolerance) {
  const double height = plane.normal.dot(point) - plane.offset;
  return std::abs(height) > tolerance ? height : 0;
}

struct Heights {
  double low = std::numeric_limits<double>::infinity(), high = -low;

  bool areBoth() const { return low < 0 && high > 0; }
  bool areNone() const { return low == 0 && high == 0; }
};

// Least and greatest height of a facet above a plane. A sliver is in its own plane, whatever the rounding.
Heights heightsOf(const Facet& facet, const Plane& plane, double tolerance) {
  if (facet.plane == plane) return {0, 0};
  Heights heights;
  for (const Corner& corner : facet.corners) {
    const double height = heightOf(corner.position, plane, tolerance);
    heights.low = std::min(heights.low, height), heights.high = std::max(heights.high, height);
  }
  return heights;
}

// Parts of a facet in front of a plane and behind it, which has corners of it on both sides.
std::pair<Facet, Facet> cut(const Facet& facet, const Plane& plane, double tolerance) {
  std::pair<Facet, Facet> parts;
  for (Facet* part : {&parts.first, &parts.second})
    part->triangle = facet.triangle, part->plane = facet.plane;
  const size_t count = facet.corners.size();
  for (size_t i = 0; i < count; ++i) {
    const Corner &from = facet.corners[i], &to = facet.corners[(i + 1) % count];
    const double fromHeight = heightOf(from.position, plane, tolerance),
                 toHeight = heightOf(to.position, plane, tolerance);
    if (fromHeight >= 0) parts.first.corners.push_back(from);
    if (fromHeight <= 0) parts.second.corners.push_back(from);
    if (fromHeight * toHeight >= 0) continue;
    // From the lower end: both triangles at an edge are cut at the same point.
    const bool isRising = fromHeight < toHeight;
    const Corner &low = isRising ? from : to, &high = isRising ? to : from;
    const double lowHeight = std::min(fromHeight, toHeight), highHeight = std::max(fromHeight, toHeight);
    const double share = lowHeight / (lowHeight - highHeight);
    const Corner crossing{low.position + share * (high.position - low.position),
                          low.barycentric + share * (high.barycentric - low.barycentric)};
    parts.first.corners.push_back(crossing);
    parts.second.corners.push_back(crossing);
  }
  parts.first.fit();
  parts.second.fit();
  return parts;
}

// Whether a hides b from some viewer that both face. Of triangles in one plane the first one of the mesh is
// in front, as in a sorted list.
bool mayHide(const Facet& a, const Facet& b, double tolerance) {
  if (b.plane.normal.dot(a.center) - b.plane.offset < -a.radius - tolerance ||
      a.plane.normal.dot(b.center) - a.plane.offset > b.radius + tolerance)
    return false; // quickly
  const Heights ofA = heightsOf(a, b.plane, tolerance);
  if (ofA.high > 0) return heightsOf(b, a.plane, tolerance).low < 0;
  return a.triangle < b.triangle && ofA.low == 0 && heightsOf(b, a.plane, tolerance).areNone() &&
         a.plane.normal.dot(b.plane.normal) > 0;
}

// Whether any facet of either list may hide one of the other.
bool areOrdered(std::span<const Facet> a, std::span<const Facet> b, double tolerance) {
  return std::ranges::any_of(a, [&](const Facet& one) {
    return std::ranges::any_of(b, [&](const Facet& other) {
      return mayHide(one, other, tolerance) || mayHide(other, one, tolerance);
    });
  });
}

// Strongly connected components of "may hide", each before those that it may hide, by Kosaraju's algorithm
// on edges that are tested when they are asked for: two searches, each of which asks for a pair once.
std::vector<std::vector<size_t>> components(std::span<const Facet> facets, double tolerance,
                                            const Progress& progress) {
  const size_t count = facets.size();
  std::vector<size_t> finished;
  std::vector<uint8_t> isVisited(count, 0);
  struct Step {
    size_t facet, next; // next: to be asked whether `facet` may hide it
  };
  std::vector<Step> path;
  for (size_t start = 0; start < count; ++start) {
    if (isVisited[start]) continue;
    isVisited[start] = 1;
    path.push_back({start, 0});
    while (!path.empty()) {
      Step& step = path.back();
      while (step.next < count &&
             (isVisited[step.next] || !mayHide(facets[step.facet], facets[step.next], tolerance)))
        ++step.next;
      if (step.next < count) {
        isVisited[step.next] = 1;
        path.push_back({step.next, 0});
      } else {
        progress.checkpoint();
        finished.push_back(step.facet);
        path.pop_back();
      }
    }
  }
  std::vector<std::vector<size_t>> result;
  for (size_t i = count; i-- > 0;) {
    if (!isVisited[finished[i]]) continue; // the second search clears the marks of the first
    isVisited[finished[i]] = 0;
    std::vector<size_t>& component = result.emplace_back(1, finished[i]);
    for (size_t k = 0; k < component.size(); ++k) {
      progress.checkpoint();
      for (size_t other = 0; other < count; ++other)
        if (isVisited[other] && mayHide(facets[other], facets[component[k]], tolerance)) {
          isVisited[other] = 0;
          component.push_back(other);
        }
    }
  }
  return result;
}

// Planes of some of the facets, and planes across several directions through corners at equal shares.
std::vector<Plane> candidatesFor(std::span<const Facet> facets) {
  constexpr size_t kTriangles = 64, kAcross = 15;
  std::vector<Plane> planes;
  const size_t step = std::max<size_t>(1, facets.size() / kTriangles);
  for (size_t i = 0; i < facets.size(); i += step) planes.push_back(facets[i].plane);
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = 0; z <= 1; ++z) {
        if (z == 0 && (y < 0 || (y == 0 && x <= 0))) continue; // opposite to another one
        const Vec3<double> direction = Vec3<double>(x, y, z).normalized();
        std::vector<double> places;
        for (const Facet& facet : facets)
          for (const Corner& corner : facet.corners) places.push_back(direction.dot(corner.position));
        std::ranges::sort(places);
        for (size_t k = 1; k <= kAcross; ++k)
          planes.push_back({direction, places[places.size() * k / (kAcross + 1)]});
      }
  return planes;
}

// The candidate with fewest cuts for the facets that it takes from the larger side. It leaves fewer facets
// and parts of facets on each side than there are, so that division comes to an end; the plane of a facet
// always does.
Plane dividerOf(std::span<const Facet> facets, double tolerance, const Progress& progress) {
  constexpr double kAnyCut = 0.25; // prefers many facets taken among planes without cuts
  constexpr double kTaken = 0.75;  // exponent: cuts grow more slowly than what is divided
  Plane best;
  double least = std::numeric_limits<double>::infinity();
  for (const Plane& plane : candidatesFor(facets)) {
    progress.checkpoint();
    size_t front = 0, back = 0, cuts = 0;
    for (const Facet& facet : facets) {
      const double height = plane.normal.dot(facet.center) - plane.offset;
      const bool isClear = std::abs(height) > facet.radius + tolerance;
      const Heights heights = isClear ? Heights{height, height} : heightsOf(facet, plane, tolerance);
      cuts += heights.areBoth();
      front += heights.low >= 0 && heights.high > 0;
      back += heights.low < 0 && heights.high <= 0;
    }
    if (front + cuts == facets.size() || back + cuts == facets.size()) continue;
    const size_t taken = facets.size() - cuts - std::max(front, back);
    const double cost = (static_cast<double>(cuts) + kAnyCut) / std::pow(static_cast<double>(taken), kTaken);
    if (cost < least) least = cost, best = plane;
  }
  return best;
}

// A facet that a plane crosses.
struct Crossing {
  Facet whole, front, back;
  enum class Use { inFront, behind, cut } use = Use::cut;
};

// Facets divided by a plane.
struct Division {
  std::vector<Facet> front, back, inPlane;
};

// Chooses what becomes of facets that a plane crosses. One is taken whole to a side if no order of its part
// on the other side can matter, neither with anything there nor in the plane.
void settle(std::vector<Crossing>& crossings, const Division& sides, double tolerance) {
  using Use = Crossing::Use;
  const auto isFree = [&](const Facet& part, std::span<const Facet> side) {
    return !areOrdered({&part, 1}, side, tolerance) && !areOrdered({&part, 1}, sides.inPlane, tolerance);
  };
  for (Crossing& crossing : crossings)
    if (isFree(crossing.back, sides.back))
      crossing.use = Use::inFront;
    else if (isFree(crossing.front, sides.front))
      crossing.use = Use::behind;
  // Whole facets also meet one another, and parts of those that are cut.
  const auto isMisplaced = [&](const Crossing& crossing, const Crossing& other) {
    const bool isInFront = crossing.use == Use::inFront;
    const Facet& astray = isInFront ? crossing.back : crossing.front;
    const Facet* met = &other.whole;
    if (other.use == Use::cut)
      met = isInFront ? &other.back : &other.front;
    else if (other.use == crossing.use)
      return false;
    return areOrdered({other.use == Use::cut ? &astray : &crossing.whole, 1}, {met, 1}, tolerance);
  };
  for (bool hasChanged = true; hasChanged;) {
    hasChanged = false;
    for (Crossing& crossing : crossings)
      if (crossing.use != Use::cut && std::ranges::any_of(crossings, [&](const Crossing& other) {
            return &other != &crossing && isMisplaced(crossing, other);
          })) {
        crossing.use = Use::cut;
        hasChanged = true;
      }
  }
}

Division divided(std::span<const Facet> facets, const Plane& plane, double tolerance) {
  Division sides;
  std::vector<Crossing> crossings;
  for (const Facet& facet : facets) {
    const Heights heights = heightsOf(facet, plane, tolerance);
    if (heights.areNone())
      sides.inPlane.push_back(facet);
    else if (heights.low >= 0)
      sides.front.push_back(facet);
    else if (heights.high <= 0)
      sides.back.push_back(facet);
    else {
      const auto [front, back] = cut(facet, plane, tolerance);
      crossings.push_back({facet, front, back});
    }
  }
  settle(crossings, sides, tolerance);
  for (const Crossing& crossing : crossings) switch (crossing.use) {
    case Crossing::Use::inFront:
      sides.front.push_back(crossing.whole);
      break;
    case Crossing::Use::behind:
      sides.back.push_back(crossing.whole);
      break;
    case Crossing::Use::cut:
      sides.front.push_back(crossing.front);
      sides.back.push_back(crossing.back);
    }
  // In one plane, the first piece of the mesh is in front.
  std::ranges::stable_sort(sides.inPlane, std::greater<>(), &Facet::triangle);
  return sides;
}

// Adds the fan of a facet.
void addFan(const Facet& facet, std::vector<Piece>& pieces) {
  const std::vector<Corner>& corners = facet.corners;
  for (size_t i = 2; i < corners.size(); ++i)
    pieces.push_back({facet.triangle,
                      {corners[0].position, corners[i - 1].position, corners[i].position},
                      {corners[0].barycentric, corners[i - 1].barycentric, corners[i].barycentric}});
}

} // namespace

std::vector<Piece> wholePieces(const TriangleMesh& mesh) {
  std::vector<Piece> pieces;
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    Piece& piece = pieces.emplace_back();
    piece.triangle = t;
    for (size_t i = 0; i < 3; ++i) {
      piece.corners[i] = mesh.positions[mesh.triangles[t][i]].cast<double>().raw();
      piece.barycentrics[i] = Vec3<double>::Unit(static_cast<Eigen::Index>(i));
    }
  }
  return pieces;
}

BspTree::BspTree(const TriangleMesh& mesh, const Progress& progress) {
  std::vector<Facet> all;
  for (const Piece& piece : wholePieces(mesh)) {
    const auto& [a, b, c] = piece.corners;
    const Vec3<double> area = (b - a).cross(c - a);
    if (area.isZero(0)) continue;
    const Vec3<double> normal = area.normalized();
    Facet& facet = all.emplace_back();
    facet.triangle = piece.triangle, facet.plane = {normal, normal.dot(a)};
    for (size_t i = 0; i < 3; ++i) facet.corners.push_back({piece.corners[i], piece.barycentrics[i]});
    facet.fit();
  }
  if (all.empty()) return;
  const double tolerance = 1e-9 * boundsOf(mesh.positions).diagonal().norm();
  // Facets of a subtree to be made: below which node, and on which side of it.
  struct Open {
    std::vector<Facet> facets;
    int32_t parent = -1;
    bool isFront = false, isCycle = false; // isCycle: known to be a single component
  };
  std::vector<Open> open;
  open.push_back({std::move(all)});
  const auto newNode = [&](int32_t parent, bool isFront) {
    const auto index = static_cast<int32_t>(nodes_.size());
    if (parent >= 0)
      (isFront ? nodes_[static_cast<size_t>(parent)].front : nodes_[static_cast<size_t>(parent)].back) =
          index;
    Node& node = nodes_.emplace_back();
    node.first = node.end = static_cast<uint32_t>(pieces_.size());
    return index;
  };
  const auto divide = [&](const Open& current) {
    const Plane plane = dividerOf(current.facets, tolerance, progress);
    Division sides = divided(current.facets, plane, tolerance);
    const int32_t node = newNode(current.parent, current.isFront);
    for (const Facet& facet : sides.inPlane) addFan(facet, pieces_);
    Node& made = nodes_[static_cast<size_t>(node)];
    made.normal = plane.normal, made.offset = plane.offset;
    made.end = static_cast<uint32_t>(pieces_.size());
    if (!sides.front.empty()) open.push_back({std::move(sides.front), node, true});
    if (!sides.back.empty()) open.push_back({std::move(sides.back), node, false});
  };
  // A chain of nodes: each has a cycle, then facets of their own, then the rest.
  const auto chain = [&](const Open& current, const std::vector<std::vector<size_t>>& groups) {
    int32_t last = -1;
    for (size_t i = groups.size(); i-- > 0;) { // back to front
      const bool isCycle = groups[i].size() > 1;
      if (last < 0)
        last = newNode(current.parent, current.isFront);
      else if (isCycle)
        last = newNode(last, true);
      if (isCycle) {
        Open& cycle = open.emplace_back(Open{{}, last, false, true});
        for (const size_t facet : groups[i]) cycle.facets.push_back(current.facets[facet]);
      } else {
        addFan(current.facets[groups[i][0]], pieces_);
        nodes_[static_cast<size_t>(last)].end = static_cast<uint32_t>(pieces_.size());
      }
    }
  };
  while (!open.empty()) {
    const Open current = std::move(open.back());
    open.pop_back();
    if (current.isCycle) {
      divide(current);
      continue;
    }
    const std::vector<std::vector<size_t>> groups = components(current.facets, tolerance, progress);
    if (groups.size() == 1 && current.facets.size() > 1)
      divide(current);
    else
      chain(current, groups);
  }
}

size_t BspTree::bytes() const { return std::span(nodes_).size_bytes() + std::span(pieces_).size_bytes(); }

std::vector<uint32_t> BspTree::backToFront(const Vec3<double>& viewer) const {
  std::vector<uint32_t> order;
  order.reserve(pieces_.size());
  struct Step {
    int32_t node;
    bool isEntered;
  };
  std::vector<Step> stack;
  if (!nodes_.empty()) stack.push_back({0, false});
  while (!stack.empty()) {
    const Step step = stack.back();
    stack.pop_back();
    const Node& node = nodes_[static_cast<size_t>(step.node)];
    const bool inFront = node.normal.dot(viewer) > node.offset;
    const int32_t near = inFront ? node.front : node.back, far = inFront ? node.back : node.front;
    if (!step.isEntered) {
      stack.push_back({step.node, true});
      if (far >= 0) stack.push_back({far, false});
      continue;
    }
    for (uint32_t piece = node.first; piece < node.end; ++piece) order.push_back(piece);
    if (near >= 0) stack.push_back({near, false});
  }
  return order;
}

} // namespace surflect::olf
