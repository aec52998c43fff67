#include "srf/proxy/mesh/mesh_mending.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace surflect::proxy {
namespace {

using Cameras = std::vector<capture::Camera<AcquisitionSpace>>;

capture::Camera<AcquisitionSpace> cameraAt(const Vec3<double>& position,
                                           const Vec3<double>& target = {0, 0, 0}) {
  const Vec3<double> z = (position - target).normalized(),
                     x = Vec3<double>(0.3, 1, 0.1).cross(z).normalized();
  Mat3<double> axes; // columns: camera axes in the world
  axes << x, z.cross(x), z;
  const capture::Lens lens{
      .width = 200, .height = 200, .focalX = 250, .focalY = 250, .centerX = 100, .centerY = 100};
  return {lens, Rigid<CameraSpace, AcquisitionSpace>(axes.transpose(), -(axes.transpose() * position))};
}

// All around, five units away; those above the plane z = 0 alone.
Cameras camerasAround(bool above = false) {
  Cameras cameras;
  for (int i = 0; i < 16; ++i) {
    const double z = 1 - (i + 0.5) / 8, r = std::sqrt(1 - z * z), angle = 2.4 * i;
    if (!above || z > 0)
      cameras.push_back(cameraAt(5 * Vec3<double>(r * std::cos(angle), r * std::sin(angle), z)));
  }
  return cameras;
}

// A sphere's part from the pole +z to the polar angle `end`, facing outwards.
TriangleMesh ball(const Vec3<double>& center = {0, 0, 0}, double radius = 1, double end = std::numbers::pi) {
  constexpr uint32_t n = 16;
  TriangleMesh mesh;
  for (uint32_t j = 0; j <= n; ++j)
    for (uint32_t i = 0; i < 2 * n; ++i) {
      const double theta = end * j / n, phi = std::numbers::pi * i / n;
      const Vec3<double> direction(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                   std::cos(theta));
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(Vec3<double>(center + radius * direction)));
    }
  for (uint32_t j = 0; j < n; ++j)
    for (uint32_t i = 0; i < 2 * n; ++i) {
      const uint32_t a = 2 * n * j + i, b = 2 * n * j + (i + 1) % (2 * n);
      mesh.triangles.push_back({a, a + 2 * n, b});
      mesh.triangles.push_back({b, a + 2 * n, b + 2 * n});
    }
  return withoutUnused(withoutFlat(std::move(mesh))); // at the poles
}

TriangleMesh square(double half) {
  TriangleMesh mesh;
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
    mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(Vec3<double>(half * x, half * y, 0)));
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TriangleMesh turned(TriangleMesh mesh) {
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

TriangleMesh joined(TriangleMesh mesh, const TriangleMesh& other) {
  const auto first = static_cast<uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
  return mesh;
}

void expectSame(const TriangleMesh& mesh, const TriangleMesh& expected) {
  EXPECT_EQ(mesh.positions, expected.positions);
  EXPECT_EQ(mesh.triangles, expected.triangles);
}

// Is mended to `expected`, with the one note.
void expectMended(const TriangleMesh& mesh, const Cameras& cameras, const TriangleMesh& expected,
                  const std::string& note) {
  const MendedMesh result = mended(mesh, cameras);
  expectSame(result.mesh, expected);
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_EQ(result.notes[0], note);
}

void expectSound(const TriangleMesh& mesh, const Cameras& cameras) {
  const MendedMesh result = mended(mesh, cameras);
  expectSame(result.mesh, mesh);
  EXPECT_EQ(result.notes, std::vector<std::string>{});
}

TEST(MeshMending, SoundMeshesComeBackAsTheyAre) {
  expectSound(ball(), camerasAround());
  expectSound(joined(ball(), ball({1.2, 0, 0}, 0.4)), camerasAround());
  expectSound(ball({0, 0, 0}, 1, std::numbers::pi / 2), camerasAround(true)); // a dome seen from above
  // A bowl of no thickness, with triangles for both of its sides.
  const TriangleMesh bowl = ball({0, 0, 0}, 1, std::numbers::pi / 2);
  expectSound(joined(bowl, turned(bowl)), camerasAround());
  expectSound(joined(square(1), turned(square(1))), camerasAround());
  expectSound(ball(), {}); // no camera, nothing to tell
}

TEST(MeshMending, PartsThatShowTheirBacksAreTurned) {
  const TriangleMesh one = ball({-0.6, 0, 0}, 0.4), other = ball({0.6, 0, 0}, 0.4);
  const std::string half = std::to_string(one.triangles.size()),
                    all = std::to_string(2 * one.triangles.size());
  const std::string why = " triangles look away from the cameras that see them: turned";
  expectMended(turned(joined(one, other)), camerasAround(), joined(one, other), all + " of " + all + why);
  expectMended(joined(one, turned(other)), camerasAround(), joined(one, other), half + " of " + all + why);
  expectMended(turned(square(1)), camerasAround(true), square(1), "2 of 2" + why);
}

TEST(MeshMending, TrianglesWoundAgainstTheirNeighboursAreTurned) {
  std::mt19937 random(1);
  for (const unsigned of : {3u, 1000u}) {
    const TriangleMesh sound = ball();
    TriangleMesh mixed = sound;
    size_t count = 0;
    for (auto& triangle : mixed.triangles)
      if (random() % of == 0) {
        std::swap(triangle[1], triangle[2]);
        ++count;
      }
    ASSERT_GT(count, 0u);
    expectMended(mixed, camerasAround(), sound,
                 std::to_string(count) + " of " + std::to_string(sound.triangles.size()) +
                     " triangles are wound against their neighbours: turned");
  }
  // Two sheets in a row that look opposite ways, each towards cameras: turning one would hide it.
  TriangleMesh sheets = square(0.5);
  sheets.positions.insert(sheets.positions.end(), {{1.5f, -0.5f, 0}, {1.5f, 0.5f, 0}});
  sheets.triangles.insert(sheets.triangles.end(), {{1, 2, 4}, {4, 2, 5}});
  const Cameras each = {cameraAt({0, 0, 1.2}), cameraAt({1, 0, -1.2}, {1, 0, 0})};
  expectMended(
      sheets, each, sheets,
      "2 of 4 triangles are wound against their neighbours, but cameras see the fronts of both: left "
      "as they are");
}

TEST(MeshMending, RepeatedTrianglesStayOnceAndUnseenBacksGo) {
  const TriangleMesh sound = ball();
  const std::string n = std::to_string(sound.triangles.size()),
                    twice = std::to_string(2 * sound.triangles.size());
  expectMended(joined(sound, sound), camerasAround(), sound,
               n + " of " + twice + " triangles repeat others: left out");
  expectMended(joined(sound, turned(sound)), camerasAround(), sound,
               n + " of " + twice + " triangles are backs of others that no camera sees: left out");
  // The backs come first: they stay, and are turned.
  const MendedMesh result = mended(joined(turned(sound), sound), camerasAround());
  expectSame(result.mesh, sound);
  EXPECT_EQ(
      result.notes,
      (std::vector{n + " of " + twice + " triangles are backs of others that no camera sees: left out",
                   n + " of " + twice + " triangles look away from the cameras that see them: turned"}));
}

// From above, all; from below, one, between the views that a choice of 32 would take.
TEST(MeshMending, BacksThatASingleCameraSeesStay) {
  Cameras cameras(100, cameraAt({0, 0, 5}));
  cameras[1] = cameraAt({0, 0, -5});
  expectSound(joined(square(1), turned(square(1))), cameras);
}

TEST(MeshMending, BacksGoOfWhichLittleIsSeen) {
  TriangleMesh sheet = square(1);
  sheet.positions.emplace_back(1.02f, 0.f, 0.f);
  sheet.triangles.push_back({1, 4, 2}); // a two-hundredth of its area; the camera below sees no more
  Cameras cameras(100, cameraAt({0, 0, 5}));
  cameras[1] = cameraAt({1.007, 0, -0.05}, {1.007, 0, 0});
  expectMended(joined(sheet, turned(sheet)), cameras, sheet,
               "3 of 6 triangles are backs of others that hardly any camera sees (0.005 %): left out");
}

TEST(MeshMending, BothSidesOfAThinSlabStay) {
  TriangleMesh slab;
  for (int corner = 0; corner < 8; ++corner)
    slab.positions.push_back(assume<Point3<AcquisitionSpace>>(
        Vec3<double>(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1e-3 : -1e-3)));
  slab.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  expectSound(slab, camerasAround());
}

TEST(MeshMending, APartThatNoCameraSeesStaysAsItIs) {
  const TriangleMesh hidden = ball({0, 0, 0}, 0.5);
  expectSound(joined(ball(), hidden), camerasAround());
  expectSound(joined(ball(), turned(hidden)), camerasAround());
  expectSound(joined(ball(), joined(hidden, turned(hidden))), camerasAround());
}

TEST(MeshMending, ASheetSeenFromBothSidesIsLeftAndTold) {
  expectMended(square(1), camerasAround(), square(1),
               "cameras see both sides of sheets with 2 of 2 triangles, which have a front only: their backs "
               "show nothing; give them triangles on both sides");
}

TEST(MeshMending, UnusedVerticesAndFarSpecksAndSpikesAreLeftOut) {
  const TriangleMesh sound = ball();
  TriangleMesh unused = sound;
  unused.positions.insert(unused.positions.end(), {{0, 0, 50}, {0, 3, 0}});
  expectMended(unused, camerasAround(), sound,
               "2 of 546 vertices belong to no triangle: left out, the farthest of them at (0, 0, 50)");

  unused = sound;
  unused.positions.emplace_back(0.f, 0.5f, 0.f); // does no harm, and is no news
  expectSame(mended(unused, camerasAround()).mesh, sound);
  EXPECT_TRUE(mended(unused, camerasAround()).notes.empty());

  TriangleMesh speck = square(0.01);
  for (auto& p : speck.positions) p = p + Direction3<AcquisitionSpace>(0, 9, 0);
  expectMended(joined(sound, speck), camerasAround(), sound,
               "2 of 994 triangles are specks far from the rest: left out, the first at (0, 9, 0)");

  EXPECT_EQ(mended(joined(joined(sound, speck), turned(speck)), camerasAround()).mesh.triangles.size(),
            sound.triangles.size());

  TriangleMesh spike = sound;
  spike.positions.insert(spike.positions.end(), {-2000, 0, 100});
  spike.triangles.push_back({40, 41, static_cast<uint32_t>(sound.positions.size())});
  expectMended(spike, camerasAround(), sound,
               "1 of 993 triangles reach far beyond the rest, to (-2000, 0, 100): left out");
}

TEST(MeshMending, WhatIsFarButSeenStays) {
  // Small, and in most pictures, which show up to two units around the origin.
  expectSound(joined(ball({0, 0, 0}, 0.2), ball({0, 1.2, 0}, 0.012)), camerasAround());
  // A floor of two triangles, under a statue of a thousand.
  const Cameras cameras = camerasAround(true);
  TriangleMesh statue = joined(ball({0, 0, 0.5}, 0.4), square(50));
  const MendedMesh result = mended(statue, cameras);
  expectSame(result.mesh, statue);
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_EQ(result.notes[0], "2 of 994 triangles reach far beyond the rest, to (50, 50, 0): kept, for they "
                             "fill more than a tenth of what cameras see");
}

} // namespace
} // namespace surflect::proxy
