#include "render/lightfield/olf/bsp_tree.h"

#include "tests/render/lightfield/olf/painted_field.h"
#include "tests/support/random.h"

#include <algorithm>
#include <set>

namespace surflect::olf {
namespace {

double areaOf(const Piece& piece) {
  return (piece.corners[1] - piece.corners[0]).cross(piece.corners[2] - piece.corners[0]).norm() / 2;
}

TEST(BspTree, PiecesCoverEachTriangle) {
  const TriangleMesh mesh = rowOfSpheres(3);
  const BspTree tree(mesh, 2);
  std::vector<double> areas(mesh.triangles.size(), 0);
  for (const Piece& piece : tree.pieces()) {
    areas[piece.triangle] += areaOf(piece);
    for (size_t i = 0; i < 3; ++i) {
      Vec3<double> p = Vec3<double>::Zero();
      for (size_t k = 0; k < 3; ++k)
        p += piece.barycentrics[i][static_cast<Eigen::Index>(k)] *
             mesh.positions[mesh.triangles[piece.triangle][k]].cast<double>().raw();
      EXPECT_LE((p - piece.corners[i]).norm(), 1e-12);
    }
  }
  for (size_t t = 0; t < areas.size(); ++t) EXPECT_NEAR(areas[t], areaVector(mesh, t).norm() / 2, 1e-12);
  EXPECT_GT(tree.pieces().size(), mesh.triangles.size());
}

TEST(BspTree, NothingHidesALaterPiece) {
  const TriangleMesh mesh = rowOfSpheres(3, 8);
  const BspTree tree(mesh, 1);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> share(0, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3<double> viewer = 4 * randomUnit(random);
    const std::vector<uint32_t> order = tree.backToFront(viewer);
    EXPECT_EQ(std::set<uint32_t>(order.begin(), order.end()).size(), tree.pieces().size());
    std::vector<size_t> rank(order.size());
    for (size_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
    // A ray through a point of a piece meets pieces in rising distance as their ranks fall.
    for (int ray = 0; ray < 50; ++ray) {
      const Piece& aim = tree.pieces()[random() % tree.pieces().size()];
      double a = share(random), b = share(random);
      if (a + b > 1) a = 1 - a, b = 1 - b;
      const Vec3<double> direction = (aim.corners[0] + a * (aim.corners[1] - aim.corners[0]) +
                                      b * (aim.corners[2] - aim.corners[0]) - viewer)
                                         .normalized();
      std::vector<std::pair<double, size_t>> met; // distances and ranks
      for (size_t i = 0; i < tree.pieces().size(); ++i) {
        const Piece& piece = tree.pieces()[i];
        const Vec3<double> e1 = piece.corners[1] - piece.corners[0], e2 = piece.corners[2] - piece.corners[0],
                           p = direction.cross(e2), t = viewer - piece.corners[0], q = t.cross(e1);
        const double determinant = e1.dot(p), u = t.dot(p) / determinant, v = direction.dot(q) / determinant;
        if (std::abs(determinant) > 1e-9 && u > 1e-6 && v > 1e-6 && u + v < 1 - 1e-6)
          met.emplace_back(e2.dot(q) / determinant, rank[i]);
      }
      std::ranges::sort(met);
      for (size_t i = 1; i < met.size(); ++i)
        EXPECT_TRUE(met[i].first - met[i - 1].first <= 1e-6 || met[i].second < met[i - 1].second);
    }
  }
}

TEST(BspTree, TheSmallestOfSeveralIsKept) {
  const TriangleMesh mesh = rowOfSpheres(3);
  size_t before = BspTree(mesh, 1).pieces().size();
  const size_t one = before;
  for (const size_t trees : {2u, 4u, 8u}) {
    const size_t pieces = BspTree(mesh, trees).pieces().size();
    EXPECT_LE(pieces, before);
    before = pieces;
  }
  EXPECT_LT(before, one);
  EXPECT_EQ(BspTree(mesh, 8).pieces().size(), before);
}

TEST(BspTree, CoplanarTrianglesShareANode) {
  TriangleMesh mesh;
  for (const auto& [x, y] : {std::pair(0, 0), {1, 0}, {0, 1}, {1, 1}})
    mesh.positions.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.f);
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}, {0, 1, 2}};
  const BspTree tree(mesh, 1);
  EXPECT_EQ(tree.pieces().size(), 3u);
  EXPECT_EQ(tree.backToFront({0, 0, 3}).size(), 3u);
}

TEST(BspTree, TwoTrianglesThatIntersectAreCut) {
  TriangleMesh mesh;
  for (const auto& p : {Vec3<float>(-1, -1, 0), {1, -1, 0}, {0, 1, 0}, {0, -1, -1}, {0, -1, 1}, {0, 1, 0.1f}})
    mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(p));
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  EXPECT_GT(BspTree(mesh, 4).pieces().size(), 2u);
}

TEST(BspTree, WithoutTrianglesThatHaveAnAreaItIsEmpty) {
  TriangleMesh mesh;
  for (int i = 0; i < 3; ++i) mesh.positions.emplace_back(static_cast<float>(i), 0.f, 0.f);
  mesh.triangles = {{0, 1, 2}};
  EXPECT_TRUE(BspTree(mesh, 2).backToFront({0, 0, 1}).empty());
}

} // namespace
} // namespace surflect::olf
