#include "render/lightfield/olf/bsp_tree.h"

#include "surfel/math/bounds.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <random>
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

Plane planeOf(const Piece& piece) {
  const Vec3<double> normal = normalOf(piece).normalized();
  return {normal, normal.dot(piece.corners[0])};
}

// Heights of a piece's corners above a plane; 0 within the tolerance.
std::array<double, 3> heightsOf(const Piece& piece, const Plane& plane, double tolerance) {
  std::array<double, 3> heights{};
  for (size_t k = 0; k < 3; ++k) {
    const double height = plane.normal.dot(piece.corners[k]) - plane.offset;
    heights[k] = std::abs(height) > tolerance ? height : 0;
  }
  return heights;
}

// The piece of the first few, which are in random order, whose plane cuts fewest; of those that cut as many
// the one with the most equal sides.
size_t dividerOf(const std::vector<Piece>& pieces, double tolerance) {
  constexpr size_t kCandidates = 8;
  constexpr size_t kCutWeight = 8; // a cut is as bad as so many more pieces on one side
  size_t best = 0, leastCost = std::numeric_limits<size_t>::max();
  for (size_t candidate = 0; candidate < std::min(kCandidates, pieces.size()); ++candidate) {
    const Plane plane = planeOf(pieces[candidate]);
    size_t front = 0, back = 0, cuts = 0;
    for (const Piece& piece : pieces) {
      const auto [low, high] = std::ranges::minmax(heightsOf(piece, plane, tolerance));
      cuts += low < 0 && high > 0;
      front += low >= 0 && high > 0;
      back += low < 0 && high <= 0;
    }
    const size_t cost = kCutWeight * cuts + (std::max(front, back) - std::min(front, back));
    if (cost < leastCost) leastCost = cost, best = candidate;
  }
  return best;
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

BspTree::Tree BspTree::treeOf(std::vector<Piece> pieces, double tolerance, size_t limit,
                              const Progress& progress) {
  struct Open {
    std::vector<Piece> pieces;
    int32_t parent;
    bool isFront;
  };
  Tree tree;
  std::vector<Open> open;
  open.push_back({std::move(pieces), -1, false});
  while (!open.empty() && tree.pieces.size() <= limit) {
    progress.checkpoint();
    Open current = std::move(open.back());
    open.pop_back();
    const auto index = static_cast<int32_t>(tree.nodes.size());
    if (current.parent >= 0) {
      Node& parent = tree.nodes[static_cast<size_t>(current.parent)];
      (current.isFront ? parent.front : parent.back) = index;
    }
    std::swap(current.pieces[0], current.pieces[dividerOf(current.pieces, tolerance)]);
    const Plane plane = planeOf(current.pieces[0]);
    Node node;
    node.normal = plane.normal, node.offset = plane.offset;
    node.first = static_cast<uint32_t>(tree.pieces.size());
    std::vector<Piece> front, back;
    for (size_t i = 0; i < current.pieces.size(); ++i) {
      const Piece& piece = current.pieces[i];
      const std::array<double, 3> heights = heightsOf(piece, plane, tolerance);
      const auto [low, high] = std::ranges::minmax(heights);
      if (i == 0 || (low == 0 && high == 0))
        tree.pieces.push_back(piece);
      else if (low >= 0)
        front.push_back(piece);
      else if (high <= 0)
        back.push_back(piece);
      else
        cut(piece, heights, front, back);
    }
    node.end = static_cast<uint32_t>(tree.pieces.size());
    // At equal depth the first triangle of the mesh is in front, as in a sorted list.
    std::stable_sort(tree.pieces.begin() + node.first, tree.pieces.end(),
                     [](const Piece& a, const Piece& b) { return a.triangle > b.triangle; });
    tree.nodes.push_back(node);
    if (!front.empty()) open.push_back({std::move(front), index, true});
    if (!back.empty()) open.push_back({std::move(back), index, false});
  }
  return tree;
}

BspTree::BspTree(const TriangleMesh& mesh, size_t trees, const Progress& progress) {
  assert(trees >= 1);
  std::vector<Piece> whole = wholePieces(mesh);
  std::erase_if(whole, [](const Piece& piece) { return normalOf(piece).isZero(0); });
  if (whole.empty()) return;
  const double tolerance = 1e-9 * boundsOf(mesh.positions).diagonal().norm();
  size_t least = std::numeric_limits<size_t>::max();
  for (size_t k = 0; k < trees; ++k) {
    progress("BSP trees", static_cast<double>(k) / static_cast<double>(trees));
    std::mt19937_64 random(k);
    // std::shuffle differs between standard libraries.
    for (size_t i = whole.size(); i > 1; --i) std::swap(whole[i - 1], whole[random() % i]);
    Tree tree = treeOf(whole, tolerance, least, progress);
    if (tree.pieces.size() >= least) continue;
    least = tree.pieces.size();
    nodes_ = std::move(tree.nodes), pieces_ = std::move(tree.pieces);
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
