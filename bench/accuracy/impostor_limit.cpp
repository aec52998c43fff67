// "In the limit, the BRDF preservation is exact as the SRF geometry converges to the real object geometry."
// [Weyrich 2005, §4.4]
//
// The field is known without interpolation: for a glossy, textured unit sphere, SRF(p, l, v) is the radiance
// that the ray p + t v sees under l. The impostor is the same sphere enlarged by d, 0 to 0.3 radii. Two
// errors of §4.4 remain: the warp rotates the impostor point otherwise than the surface point behind it, and
// the ray mapped back by L meets the surface at another point than the warped ray. To first order, both are d
// times a derivative of the warp, and so fall linearly with d.
#include "bench/accuracy/claims.h"
#include "render/stage/material/ward.h"
#include "render/surfels/frame.h"
#include "render/surfels/queries.h"
#include "warp/deform.h"

#include <random>

namespace surflect::bench {

namespace {

using Vec = Vec3<double>;
using Vec4 = Eigen::Vector4d;

struct Query {
  Vec n, v, l; // normal of the impostor, directions to viewer and light; unit, acquisition space
};

Vec uniformUnit(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return Vec(x, y, z).normalized();
}

// Directions v for which the ray p + t v meets the sphere for every d up to 0.3: sin(theta) (1 + d) < 1.
std::vector<Query> randomQueries(size_t count, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Query> queries;
  while (queries.size() < count) {
    const Query q{uniformUnit(random), uniformUnit(random), uniformUnit(random)};
    if (q.n.dot(q.v) > 0.7 && q.n.dot(q.l) > 0.3) queries.push_back(q);
  }
  return queries;
}

SurfelCloud blownUp(const std::vector<Query>& queries, double d) {
  SurfelCloud cloud;
  for (const Query& q : queries) {
    cloud.p0.push_back(assume<Point3<AcquisitionSpace>>(Vec((1 + d) * q.n)));
    cloud.r0.push_back(rodriguesOf(assume<Normal3<AcquisitionSpace>>(q.n)));
  }
  cloud.radius.resize(queries.size(), 0.01f);
  cloud.coverage.resize(queries.size(), 1.f);
  return cloud;
}

// First intersection of the ray p + t v with the unit sphere, as seen by the viewer; not finite if it misses.
Vec seenAlong(const Vec& p, const Vec& v) {
  const double b = p.dot(v);
  return p + (-b + std::sqrt(b * b - p.squaredNorm() + 1)) * v;
}

// The point q of the unit sphere that the ray p* + s v* meets after the warp: Psi(q) = p* + s v*, |q| = 1, by
// Newton's method from a nearby start. Empty if it does not converge.
std::optional<Vec> seenAlong(const warp::Warp& warp, const Vec& p, const Vec& v, const Vec& start) {
  Vec q = start;
  double s = v.dot(warp.position(q) - p);
  for (int step = 0; step < 30; ++step) {
    Vec4 residual;
    residual << warp.position(q) - p - s * v, q.squaredNorm() - 1;
    if (residual.norm() < 1e-12) return q;
    Eigen::Matrix4d derivative = Eigen::Matrix4d::Zero();
    derivative.topLeftCorner<3, 3>() = *warp.jacobian(q);
    derivative.topRightCorner<3, 1>() = -v;
    derivative.bottomLeftCorner<1, 3>() = 2 * q.transpose();
    const Vec4 change = derivative.fullPivLu().solve(residual);
    q -= change.head<3>();
    s -= change[3];
  }
  return std::nullopt;
}

// Radiance that the point q of the sphere at rest, with normal n, sends towards v under l: a textured diffuse
// part and gloss.
double radianceAt(const Vec& q, const Vec& n, const Vec& l, const Vec& v) {
  const double texture = 0.5 + 0.25 * std::sin(6 * q.x() + 1) * std::sin(6 * q.y() + 2) + 0.25 * q.z();
  const material::Ward ward{material::gray(texture), material::gray(0.2), {0.3, 0.3}};
  Mat3<double> frame; // any tangent, as the gloss is isotropic
  frame.col(2) = n;
  frame.col(0) = n.unitOrthogonal();
  frame.col(1) = n.cross(frame.col(0));
  return material::evaluate(ward, assume<material::ShadingDirection>(frame.transpose() * l),
                            assume<material::ShadingDirection>(frame.transpose() * v))
      .g;
}

struct LimitError {
  double radiance = 0; // RMS error over the RMS of the truth
  double withoutL = 0; // the same for directions that are not brought back by L
  double shift = 0;    // RMS distance, at rest, between the hit points of the two rays; radii
  double turn = 0;     // RMS angle between the normal mapped back by L and that of the hit point; radians
  size_t queries = 0;  // number of rays that meet the deformed sphere
};

// Error over random surfels, seen and lit from random directions. The warp has an exact Jacobian and
// displaces the sphere little enough for Newton's method.
LimitError limitError(const warp::Warp& warp, double d, size_t count, uint64_t seed) {
  const std::vector<Query> queries = randomQueries(count, seed);
  const SurfelCloud cloud = blownUp(queries, d);
  const DeformedCloud deformedCloud = warp::deform(cloud, warp);
  LimitError error;
  double squaredError = 0, squaredWithoutL = 0, squaredTruth = 0;
  for (size_t i = 0; i < count; ++i) {
    const auto& [n, v, l] = queries[i];
    const Mat3<double> objectFromAcquisition =
        surfels::lookUpAt(cloud, deformedCloud, i).matrix().transpose();
    const Vec vObject = objectFromAcquisition * v, lObject = objectFromAcquisition * l;
    const Vec answered = seenAlong(cloud.p0[i].raw().cast<double>(), v);
    const auto seen = seenAlong(warp, deformedCloud.p[i].raw().cast<double>(), vObject, answered);
    if (!seen) continue;
    const Mat3<double> jacobian = *warp.jacobian(*seen);
    const Vec nObject = (jacobian.inverse().transpose() * *seen).normalized();
    if (nObject.dot(vObject) < 0.1 || nObject.dot(lObject) < 0.1) continue; // another sheet, or unlit
    const double truth = radianceAt(*seen, nObject, lObject, vObject);
    squaredError += material::squared(radianceAt(answered, answered, l, v) - truth);
    const Vec unturned = seenAlong(cloud.p0[i].raw().cast<double>(), vObject);
    const double withoutL = unturned.allFinite() ? radianceAt(unturned, unturned, lObject, vObject) : 0;
    squaredWithoutL += material::squared(withoutL - truth);
    squaredTruth += material::squared(truth);
    error.shift += (answered - *seen).squaredNorm();
    const Vec normalBack = objectFromAcquisition.transpose() * nObject;
    error.turn += material::squared(std::atan2(normalBack.cross(answered).norm(), normalBack.dot(answered)));
    ++error.queries;
  }
  error.radiance = std::sqrt(squaredError / squaredTruth);
  error.withoutL = std::sqrt(squaredWithoutL / squaredTruth);
  error.shift = std::sqrt(error.shift / static_cast<double>(error.queries));
  error.turn = std::sqrt(error.turn / static_cast<double>(error.queries));
  return error;
}

} // namespace

Json impostorLimit() {
  const Vec3<double> middle(0, 0, 0), z(0, 0, 1);
  const std::pair<const char*, warp::WarpPointer> warps[] = {
      {"rigid",
       warp::rigidWarp(Vec3<double>(1, 2, 3).normalized(), Angle::fromDegrees(70), middle, {1, -2, 0.5})},
      {"twist", warp::twistWarp(z, Angle::fromDegrees(40), middle)},
      {"bend", warp::bendWarp(z, Vec3<double>(1, 0, 0), Angle::fromDegrees(25), middle)},
      {"stretch", warp::scaleWarp({1, 1, 1.5}, middle)}};
  Json report;
  for (const auto& [name, warp] : warps)
    for (const double distance : {0.2, 0.1, 0.05, 0.025, 0.0125, 0.0}) {
      const LimitError error = limitError(*warp, distance, 4000, 1);
      report[name].push_back({{"distance", distance},
                              {"error", error.radiance},
                              {"error_without_l", error.withoutL},
                              {"shift", error.shift},
                              {"turn_deg", Angle::fromRadians(error.turn).degrees()},
                              {"queries", error.queries}});
    }
  return report;
}

} // namespace surflect::bench
