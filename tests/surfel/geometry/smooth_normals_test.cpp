#include "surfel/geometry/smooth_normals.h"

#include "surfel/sampling.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

namespace surflect {
namespace {

using Vector = Vec3<double>;
using Point = Point3<AcquisitionSpace>;

// An octahedron whose triangles are cut into four and pushed onto the unit sphere, again and again, vertices
// moved about on it by up to `jitter` of an edge.
TriangleMesh roundBall(int cuts, double jitter, uint32_t seed) {
  std::vector<Vector> points{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  TriangleMesh mesh;
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int cut = 0; cut < cuts; ++cut) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
    const auto middle = [&](uint32_t a, uint32_t b) {
      const auto [found, isNew] =
          middles.try_emplace(std::minmax(a, b), static_cast<uint32_t>(points.size()));
      if (isNew) points.push_back((points[a] + points[b]).normalized());
      return found->second;
    };
    std::vector<std::array<uint32_t, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> offset(-jitter / (1 << cuts), jitter / (1 << cuts));
  for (const Vector& p : points)
    mesh.positions.push_back(assume<Point>(
        Vector(p + Vector(offset(random), offset(random), offset(random))).normalized().cast<float>()));
  return mesh;
}

Vector at(const TriangleMesh& mesh, size_t triangle, const Vector& weights) {
  Vector p = Vector::Zero();
  for (size_t k = 0; k < 3; ++k)
    p += weights[static_cast<int>(k)] * mesh.positions[mesh.triangles[triangle][k]].cast<double>().raw();
  return p;
}

Vector randomWeights(std::mt19937& random) {
  std::exponential_distribution<double> share;
  const Vector weights(share(random), share(random), share(random));
  return weights / weights.sum();
}

// The largest angle between normals and `normalAt(p)`, at random points of the mesh.
template <class NormalAt> double worstAngle(const TriangleMesh& mesh, const NormalAt& normalAt) {
  const SmoothNormals normals(mesh);
  std::mt19937 random(5);
  double worst = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector p = at(mesh, t, randomWeights(random));
    worst = std::max(worst, normals.at(t, p).cross(normalAt(p).normalized()).norm());
  }
  return worst;
}

TriangleMesh transformed(TriangleMesh mesh, const Mat3<double>& linear, const Vector& offset) {
  for (auto& p : mesh.positions)
    p = assume<Point>(Vector(linear * p.cast<double>().raw() + offset).cast<float>());
  return mesh;
}

// [Max 1999]: exact at vertices on a sphere, and an interpolated normal there is along its own point.
TEST(SmoothNormals, OfABallAreExact) {
  for (const uint32_t seed : {1u, 2u, 3u})
    EXPECT_LT(worstAngle(roundBall(4, 0.3, seed), [](const Vector& p) { return p; }), 2e-5);
}

// n times 2n vertices, alike but for a smooth map, so that what is of first order cancels across a vertex.
TriangleMesh torus(uint32_t n) {
  TriangleMesh mesh;
  for (uint32_t i = 0; i < n; ++i)
    for (uint32_t j = 0; j < 2 * n; ++j) {
      const double a = 2 * std::numbers::pi * i / n, b = std::numbers::pi * j / n;
      mesh.positions.push_back(assume<Point>(Vector((1 + 0.4 * std::cos(a)) * std::cos(b),
                                                    (1 + 0.4 * std::cos(a)) * std::sin(b), 0.4 * std::sin(a))
                                                 .cast<float>()));
    }
  const auto at = [&](uint32_t i, uint32_t j) { return i % n * 2 * n + j % (2 * n); };
  for (uint32_t i = 0; i < n; ++i)
    for (uint32_t j = 0; j < 2 * n; ++j) {
      mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  return mesh;
}

TEST(SmoothNormals, OfATorusConvergeAtSecondOrder) {
  const auto error = [](uint32_t n) {
    return worstAngle(torus(n), [](const Vector& p) {
      const double radius = std::hypot(p.x(), p.y());
      return Vector(p.x() * (1 - 1 / radius), p.y() * (1 - 1 / radius), p.z());
    });
  };
  const double coarse = error(24), fine = error(48), finest = error(96);
  EXPECT_LT(coarse, 0.02);
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.3);
  EXPECT_NEAR(std::log2(fine / finest), 2, 0.3);
}

TriangleMesh box() {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.positions.emplace_back(static_cast<float>(corner & 1), static_cast<float>(corner >> 1 & 1),
                                static_cast<float>(corner >> 2));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST(SmoothNormals, ABoxKeepsItsEdges) {
  const TriangleMesh mesh = box();
  const SmoothNormals normals(mesh);
  std::mt19937 random(6);
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int i = 0; i < 100; ++i)
      EXPECT_LT((normals.at(t, at(mesh, t, randomWeights(random))) - areaVector(mesh, t).normalized()).norm(),
                1e-6);
}

// The side of a prism is round where its sides are many, and flat where they are few.
TEST(SmoothNormals, AreRoundUpToTheCreaseAngle) {
  for (const int sides : {8, 10, 24}) {
    TriangleMesh prism;
    for (int i = 0; i < sides; ++i)
      for (const float z : {0.f, 1.f}) {
        const double phi = 2 * std::numbers::pi * i / sides;
        prism.positions.emplace_back(static_cast<float>(std::cos(phi)), static_cast<float>(std::sin(phi)), z);
      }
    const auto corners = static_cast<uint32_t>(2 * sides);
    for (uint32_t i = 0; i < corners; i += 2) {
      const uint32_t next = (i + 2) % corners;
      prism.triangles.push_back({i, next, next + 1});
      prism.triangles.push_back({i, next + 1, i + 1});
    }
    const SmoothNormals normals(prism);
    for (size_t t = 0; t < prism.triangles.size(); ++t) {
      const Vector facet = areaVector(prism, t).normalized(), edge = at(prism, t, {1, 0, 0});
      const double turn = std::acos(std::min(1., normals.at(t, edge).dot(facet)));
      const double halfEdge = std::numbers::pi / sides;
      EXPECT_NEAR(turn, sides == 8 ? 0 : halfEdge, 0.25 * halfEdge)
          << sides; // triangles lean the mean a little
    }
  }
}

TEST(SmoothNormals, TurnWithTheMesh) {
  const TriangleMesh mesh =
      transformed(roundBall(3, 0.4, 8), Vector(1, 0.6, 1.4).asDiagonal(), Vector::Zero());
  const Mat3<double> turn = Eigen::AngleAxisd(1.1, Vector(1, -2, 3).normalized()).toRotationMatrix();
  const Vector offset(3, -1, 2);
  const TriangleMesh moved = transformed(mesh, 2 * turn, offset);
  const SmoothNormals before(mesh), after(moved);
  std::mt19937 random(9);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector weights = randomWeights(random);
    EXPECT_LT((after.at(t, at(moved, t, weights)) - turn * before.at(t, at(mesh, t, weights))).norm(), 1e-4);
  }
}

TEST(SmoothNormals, VerticesAtOnePlaceAreOne) {
  const TriangleMesh mesh = roundBall(3, 0.4, 10);
  TriangleMesh apart;
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<uint32_t>(apart.positions.size());
    for (const uint32_t vertex : triangle) apart.positions.push_back(mesh.positions[vertex]);
    apart.triangles.push_back({first, first + 1, first + 2});
  }
  const SmoothNormals shared(mesh), separate(apart);
  std::mt19937 random(11);
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector p = at(mesh, t, randomWeights(random));
    EXPECT_LT((shared.at(t, p) - separate.at(t, p)).norm(), 1e-6);
  }
}

// However wild the mesh.
TEST(SmoothNormals, StayWithinTheCreaseAngleOfTheirTriangle) {
  std::mt19937 random(12);
  std::uniform_real_distribution<float> coordinate(-1, 1);
  TriangleMesh wild;
  for (int i = 0; i < 12; ++i)
    wild.positions.emplace_back(coordinate(random), coordinate(random), coordinate(random));
  std::uniform_int_distribution<uint32_t> vertex(0, 11);
  while (wild.triangles.size() < 80) {
    wild.triangles.push_back({vertex(random), vertex(random), vertex(random)});
    if (!(areaVector(wild, wild.triangles.size() - 1).norm() > 0)) wild.triangles.pop_back();
  }
  for (uint32_t i = 0; i < 300; ++i) wild.triangles.push_back({0, 1, 2 + i % 10}); // a fan of too many
  const SmoothNormals normals(wild);
  for (size_t t = 0; t < wild.triangles.size(); ++t) {
    const Vector n = normals.at(t, at(wild, t, randomWeights(random)));
    EXPECT_NEAR(n.norm(), 1, 1e-6);
    EXPECT_GE(n.dot(areaVector(wild, t).normalized()), std::cos(kCreaseAngle.radians()) - 1e-6);
  }
}

TEST(SmoothNormals, SameBitsForAnyThreads) {
  const TriangleMesh mesh = roundBall(4, 0.3, 13);
  const SmoothNormals reference(mesh);
  for (const int threads : {1, 3})
    tbb::task_arena(threads).execute([&] {
      const SmoothNormals normals(mesh);
      for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vector middle = at(mesh, t, Vector::Constant(1 / 3.));
        EXPECT_EQ(normals.at(t, middle), reference.at(t, middle));
      }
    });
}

// Purpose of smooth normals: on a roundBall whose triangles lean by 11 degrees, surfels face away from its
// centre. They lie slightly beside the triangle whose point was nearest.
TEST(Sampling, SurfelsOfACoarseBallHaveItsNormals) {
  const SurfelCloud cloud = sampleSurfels(roundBall(2, 0, 1), 0.05);
  for (size_t i = 0; i < cloud.size(); ++i)
    EXPECT_GT(rotationOf<double>(cloud.r0[i]).col(2).dot(cloud.p0[i].cast<double>().raw().normalized()),
              std::cos(Angle::fromDegrees(1).radians()));
}

} // namespace
} // namespace surflect
