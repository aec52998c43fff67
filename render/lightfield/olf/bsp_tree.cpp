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

struct Vertex {
  Vec3<double> position, barycentric;
  double height; // above the plane; 0 within the tolerance
};

// Fan of a polygon of three or four corners.
void addFan(uint32_t triangle, const std::vector<Vertex>& polygon, std::vector<Piece>& pieces) {
  for (size_t i = 2; i < polygon.size(); ++i)
    pieces.push_back({triangle,
                      {polygon[0].position, polygon[i - 1].position, polygon[i].position},
                      {polygon[0].barycentric, polygon[i - 1].barycentric, polygon[i].barycentric}});
}

// Cuts a piece along a plane, which has corners of it on both sides.
void cut(const Piece& piece, const std::array<double, 3>& heights, std::vector<Piece>& front,
         std::vector<Piece>& back) {
  std::vector<Vertex> above, below;
  for (size_t i = 0; i < 3; ++i) {
    const Vertex from{piece.corners[i], piece.barycentrics[i], heights[i]};
    const size_t j = (i + 1) % 3;
    const Vertex to{piece.corners[j], piece.barycentrics[j], heights[j]};
    if (from.height >= 0) above.push_back(from);
    if (from.height <= 0) below.push_back(from);
    if (from.height * to.height >= 0) continue;
    // From the lower end: both triangles at an edge are cut at the same point.
    const Vertex &low = from.height < to.height ? from : to, &high = from.height < to.height ? to : from;
    const double share = low.height / (low.height - high.height);
    const Vertex crossing{low.position + share * (high.position - low.position),
                          low.barycentric + share * (high.barycentric - low.barycentric), 0};
    above.push_back(crossing);
    below.push_back(crossing);
  }
  addFan(piece.triangle, above, front);
  addFan(piece.triangle, below, back);
}

Vec3<double> normalOf(const Piece& piece) {
  return (piece.corners[1] - piece.corners[0]).cross(piece.corners[2] - piece.corners[0]);
}

struct Plane {
  Vec3<double> normal;
  double offset;
};

// A piece and the plane of its triangle: that of a sliver would be uncertain.
struct Facet {
  Piece piece;
  Plane plane;
};

// Heights of a piece's corners above a plane; 0 within the tolerance.
std::array<double, 3> heightsOf(const Piece& piece, const Plane& plane, double tolerance) {
  std::array<double, 3> heights{};
  for (size_t k = 0; k < 3; ++k) {
    const double height = plane.normal.dot(piece.corners[k]) - plane.offset;
    heights[k] = std::abs(height) > tolerance ? height : 0;
  }
  return heights;
}

// Whether a hides b from some viewer that both face. Of triangles in one plane the first one of the mesh is
// in front, as in a sorted list.
bool mayHide(const Facet& a, const Facet& b, double tolerance) {
  const std::array<double, 3> ofA = heightsOf(a.piece, b.plane, tolerance);
  const bool isInFront = std::ranges::max(ofA) > 0;
  if (!isInFront && (a.piece.triangle >= b.piece.triangle || std::ranges::min(ofA) < 0)) return false;
  const std::array<double, 3> ofB = heightsOf(b.piece, a.plane, tolerance);
  if (isInFront) return std::ranges::min(ofB) < 0;
  return std::ranges::all_of(ofB, [](double height) { return height == 0; }) &&
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

// Planes that may divide facets: those of some of their triangles, and planes across several directions
// through corners at equal shares.
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
          for (const Vec3<double>& corner : facet.piece.corners) places.push_back(direction.dot(corner));
        std::ranges::sort(places);
        for (size_t k = 1; k <= kAcross; ++k)
          planes.push_back({direction, places[places.size() * k / (kAcross + 1)]});
      }
  return planes;
}

// The candidate with fewest cuts for the facets that it takes from the larger side. One that leaves all
// facets, or parts of them, on one side divides nothing; the plane of a facet does not.
Plane dividerOf(std::span<const Facet> facets, double tolerance, const Progress& progress) {
  constexpr double kAnyCut = 0.25; // prefers many facets taken among planes without cuts
  constexpr double kTaken = 0.75;  // exponent: cuts grow more slowly than what is divided
  Plane best = facets[0].plane;
  double least = std::numeric_limits<double>::infinity();
  for (const Plane& plane : candidatesFor(facets)) {
    progress.checkpoint();
    size_t front = 0, back = 0, cuts = 0;
    for (const Facet& facet : facets) {
      const auto [low, high] = std::ranges::minmax(heightsOf(facet.piece, plane, tolerance));
      cuts += low < 0 && high > 0;
      front += low >= 0 && high > 0;
      back += low < 0 && high <= 0;
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
  Facet whole;
  std::vector<Facet> front, back; // its parts
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
  for (Crossing& crossing : crossings)
    if (!areOrdered(crossing.back, sides.back, tolerance) &&
        !areOrdered(crossing.back, sides.inPlane, tolerance))
      crossing.use = Use::inFront;
    else if (!areOrdered(crossing.front, sides.front, tolerance) &&
             !areOrdered(crossing.front, sides.inPlane, tolerance))
      crossing.use = Use::behind;
  // Whole facets also meet one another, and parts of those that are cut.
  const auto isMisplaced = [&](const Crossing& crossing, const Crossing& other) {
    const bool isInFront = crossing.use == Use::inFront;
    const std::span<const Facet> astray = isInFront ? crossing.back : crossing.front;
    if (other.use == Use::cut) return areOrdered(astray, isInFront ? other.back : other.front, tolerance);
    return other.use != crossing.use && areOrdered({&crossing.whole, 1}, {&other.whole, 1}, tolerance);
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
    const std::array<double, 3> heights = heightsOf(facet.piece, plane, tolerance);
    const auto [low, high] = std::ranges::minmax(heights);
    if (low == 0 && high == 0)
      sides.inPlane.push_back(facet);
    else if (low >= 0)
      sides.front.push_back(facet);
    else if (high <= 0)
      sides.back.push_back(facet);
    else {
      std::vector<Piece> front, back;
      cut(facet.piece, heights, front, back);
      Crossing& crossing = crossings.emplace_back(Crossing{facet, {}, {}});
      for (const Piece& piece : front) crossing.front.push_back({piece, facet.plane});
      for (const Piece& piece : back) crossing.back.push_back({piece, facet.plane});
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
      sides.front.insert(sides.front.end(), crossing.front.begin(), crossing.front.end());
      sides.back.insert(sides.back.end(), crossing.back.begin(), crossing.back.end());
    }
  // Of pieces in one plane the first one of the mesh is in front.
  std::ranges::stable_sort(sides.inPlane, std::greater<>(),
                           [](const Facet& facet) { return facet.piece.triangle; });
  return sides;
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

// Adds the nodes and pieces of a tree.
class BspBuilder {
public:
  BspBuilder(BspTree& tree, double tolerance, const Progress& progress)
      : tree_(tree), tolerance_(tolerance), progress_(progress) {}

  // Adds nodes for facets, of which there is at least one. Returns the first of them.
  int32_t add(const std::vector<Facet>& facets) {
    const std::vector<std::vector<size_t>> groups = components(facets, tolerance_, progress_);
    if (groups.size() == 1 && facets.size() > 1) return addDivided(facets);
    int32_t first = -1, last = -1;
    for (size_t i = groups.size(); i-- > 0;) { // back to front
      const bool isCycle = groups[i].size() > 1;
      if (first < 0 || isCycle) {
        const int32_t node = newNode();
        (last < 0 ? first : tree_.nodes_[static_cast<size_t>(last)].front) = node;
        last = node;
      }
      if (isCycle) {
        std::vector<Facet> cycle;
        for (const size_t facet : groups[i]) cycle.push_back(facets[facet]);
        const int32_t back = addDivided(cycle);
        BspTree::Node& node = tree_.nodes_[static_cast<size_t>(last)];
        node.back = back;
        node.first = node.end = static_cast<uint32_t>(tree_.pieces_.size());
      } else {
        tree_.pieces_.push_back(facets[groups[i][0]].piece);
        tree_.nodes_[static_cast<size_t>(last)].end = static_cast<uint32_t>(tree_.pieces_.size());
      }
    }
    return first;
  }

private:
  int32_t newNode() {
    BspTree::Node& node = tree_.nodes_.emplace_back();
    node.first = node.end = static_cast<uint32_t>(tree_.pieces_.size());
    return static_cast<int32_t>(tree_.nodes_.size()) - 1;
  }

  int32_t addDivided(std::span<const Facet> facets) {
    const Plane plane = dividerOf(facets, tolerance_, progress_);
    const Division sides = divided(facets, plane, tolerance_);
    const int32_t node = newNode();
    for (const Facet& facet : sides.inPlane) tree_.pieces_.push_back(facet.piece);
    const auto end = static_cast<uint32_t>(tree_.pieces_.size());
    const int32_t front = sides.front.empty() ? -1 : add(sides.front);
    const int32_t back = sides.back.empty() ? -1 : add(sides.back);
    BspTree::Node& made = tree_.nodes_[static_cast<size_t>(node)];
    made.normal = plane.normal, made.offset = plane.offset;
    made.end = end, made.front = front, made.back = back;
    return node;
  }

  BspTree& tree_;
  double tolerance_;
  const Progress& progress_;
};

BspTree::BspTree(const TriangleMesh& mesh, const Progress& progress) {
  std::vector<Facet> facets;
  for (const Piece& piece : wholePieces(mesh)) {
    const Vec3<double> normal = normalOf(piece);
    if (normal.isZero(0)) continue;
    facets.push_back({piece, {normal.normalized(), normal.normalized().dot(piece.corners[0])}});
  }
  if (facets.empty()) return;
  const double tolerance = 1e-9 * boundsOf(mesh.positions).diagonal().norm();
  BspBuilder(*this, tolerance, progress).add(facets);
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
