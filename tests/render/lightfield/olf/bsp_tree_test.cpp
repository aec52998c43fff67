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
  const BspTree tree(mesh);
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

// Pairs of pieces along rays of which the farther one does not come first, though both face the viewer; of
// pieces at one depth, the one that is later in the mesh. Gaps below 1e-6 count as one depth only if they are
// below 1e-12, where triangles lie in one plane.
size_t misplacedPairs(const BspTree& tree, double viewerDistance, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0, 1);
  size_t misplaced = 0, pairs = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3<double> viewer = viewerDistance * randomUnit(random);
    const std::vector<uint32_t> order = tree.backToFront(viewer);
    EXPECT_EQ(std::set<uint32_t>(order.begin(), order.end()).size(), tree.pieces().size());
    EXPECT_EQ(order.size(), tree.pieces().size());
    std::vector<size_t> rank(order.size());
    for (size_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
    for (int ray = 0; ray < 50; ++ray) {
      const Piece& aim = tree.pieces()[random() % tree.pieces().size()];
      double a = share(random), b = share(random);
      if (a + b > 1) a = 1 - a, b = 1 - b;
      const Vec3<double> direction = (aim.corners[0] + a * (aim.corners[1] - aim.corners[0]) +
                                      b * (aim.corners[2] - aim.corners[0]) - viewer)
                                         .normalized();
      std::vector<std::pair<double, size_t>> met; // distances, and indices of pieces
      for (size_t i = 0; i < tree.pieces().size(); ++i) {
        const Piece& piece = tree.pieces()[i];
        const Vec3<double> e1 = piece.corners[1] - piece.corners[0], e2 = piece.corners[2] - piece.corners[0],
                           p = direction.cross(e2), t = viewer - piece.corners[0], q = t.cross(e1);
        const double determinant = e1.dot(p), u = t.dot(p) / determinant, v = direction.dot(q) / determinant,
                     distance = e2.dot(q) / determinant;
        if (determinant > 1e-9 && u > 1e-6 && v > 1e-6 && u + v < 1 - 1e-6 && distance > 0)
          met.emplace_back(distance, i);
      }
      std::ranges::sort(met);
      for (size_t i = 1; i < met.size(); ++i) {
        const auto [distance, piece] = met[i];
        const auto [nearDistance, nearPiece] = met[i - 1];
        const double gap = distance - nearDistance;
        if (gap > 1e-12 && gap <= 1e-6) continue; // which is in front, rounding says
        const bool isPieceFirst =
            gap > 1e-12 || tree.pieces()[piece].triangle > tree.pieces()[nearPiece].triangle;
        misplaced += isPieceFirst != (rank[piece] < rank[nearPiece]);
        ++pairs;
      }
    }
  }
  EXPECT_GT(pairs, 70u);
  return misplaced;
}

TEST(BspTree, NothingThatFacesTheViewerHidesALaterPiece) {
  std::mt19937 random(9);
  for (const double viewerDistance : {0.5, 4.0})
    EXPECT_EQ(misplacedPairs(BspTree(rowOfSpheres(3, 8)), viewerDistance, random), 0u);
}

// Triangles that meet at random. `thickness`: half of them are slivers so thin; 1: none. Places are multiples
// of `step`, 0: any.
TriangleMesh soup(size_t count, float thickness, float step, std::mt19937& random) {
  std::uniform_real_distribution<float> number(-1, 1);
  const auto any = [&] {
    const float x = number(random), y = number(random);
    return Vec3<float>(x, y, number(random));
  };
  TriangleMesh mesh;
  for (uint32_t t = 0; t < count; ++t) {
    const Vec3<float> middle = any(), along = any();
    const bool isSliver = t % 2 == 0 && thickness < 1;
    for (size_t corner = 0; corner < 3; ++corner) {
      Vec3<float> p =
          middle + (isSliver ? Vec3<float>(number(random) * along + thickness * any()) : any()) * 0.4f;
      if (step > 0) p = (p / step).array().round().matrix() * step;
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(p));
    }
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return mesh;
}

TEST(BspTree, OrdersTrianglesThatMeetAtRandomAndSlivers) {
  std::mt19937 random(10);
  for (const float thickness : {1.f, 1e-3f, 1e-5f, 1e-7f})
    for (const float step : {0.f, 0.125f}) {
      const BspTree tree(soup(120, thickness, step, random));
      EXPECT_EQ(misplacedPairs(tree, 4, random), 0u) << thickness << ", " << step;
      EXPECT_LT(tree.pieces().size(), 120u * 9) << thickness << ", " << step;
    }
}

TEST(BspTree, OfCopiesTheFirstIsInFront) {
  std::mt19937 random(11);
  TriangleMesh mesh = soup(60, 1, 0, random);
  const std::vector<std::array<uint32_t, 3>> once = mesh.triangles;
  mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
  EXPECT_EQ(misplacedPairs(BspTree(mesh), 4, random), 0u);
}

TEST(BspTree, OnlyTrianglesWithoutAnOrderForAllViewersAreCut) {
  const TriangleMesh sphere = lightfield::bumpySphere(0, 24);
  EXPECT_EQ(BspTree(sphere).pieces().size(), sphere.triangles.size()); // none hides another
  const TriangleMesh bumpy = lightfield::bumpySphere(0.15, 24);
  EXPECT_LT(static_cast<double>(BspTree(bumpy).pieces().size()),
            1.5 * static_cast<double>(bumpy.triangles.size()));
}

TEST(BspTree, CoplanarTrianglesAreNotCut) {
  TriangleMesh mesh;
  for (const auto& [x, y] : {std::pair(0, 0), {1, 0}, {0, 1}, {1, 1}})
    mesh.positions.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.f);
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}, {0, 1, 2}};
  const BspTree tree(mesh);
  EXPECT_EQ(tree.pieces().size(), 3u);
  EXPECT_EQ(tree.backToFront({0, 0, 3}).size(), 3u);
}

TEST(BspTree, TwoTrianglesThatIntersectAreCut) {
  TriangleMesh mesh;
  for (const auto& p : {Vec3<float>(-1, -1, 0), {1, -1, 0}, {0, 1, 0}, {0, -1, -1}, {0, -1, 1}, {0, 1, 0.1f}})
    mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(p));
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  EXPECT_GT(BspTree(mesh).pieces().size(), 2u);
}

TEST(BspTree, WithoutTrianglesThatHaveAnAreaItIsEmpty) {
  TriangleMesh mesh;
  for (int i = 0; i < 3; ++i) mesh.positions.emplace_back(static_cast<float>(i), 0.f, 0.f);
  mesh.triangles = {{0, 1, 2}};
  EXPECT_TRUE(BspTree(mesh).backToFront({0, 0, 1}).empty());
}

} // namespace
} // namespace surflect::olf
