#include "tests/stability/entry.h"

#include "surfel/cloud.h"
#include "tests/render/clouds.h"
#include "tests/support/random.h"
#include "warp/deform.h"

#include <Eigen/Geometry>

#include <numbers>

namespace surflect::stability {
namespace {

using V = Vec3<double>;

double inDegrees(double radians) { return radians * 180 / std::numbers::pi; }

double largestEntry(const Mat3<double>& m) { return m.allFinite() ? m.cwiseAbs().maxCoeff() : kNoAnswer; }

// Angle of the rotation between two orthogonal matrices, degrees.
double turnBetween(const Mat3<double>& a, const Mat3<double>& b) {
  if (!a.allFinite() || !b.allFinite()) return kNoAnswer;
  return inDegrees(2 * std::asin(std::min(1.0, (a - b).norm() / std::sqrt(8.0))));
}

// n0 after r0 = k tan(theta / 2) as the paper writes it, in single precision: the shortest arc from z to n0.
Measured storedNormal(double angleFromMinusZ) {
  const V n0 = Eigen::AngleAxisd(angleFromMinusZ, V(0.6, 0.8, 0)) * V(0, 0, -1);
  const Vec3<float> n = n0.cast<float>();
  const float rx = -n[1] / (1 + n[2]), ry = n[0] / (1 + n[2]);
  const float c = 2 / (1 + rx * rx + ry * ry);
  const V paper(double{c * ry}, double{-c * rx}, double{1 - c * (rx * rx + ry * ry)});
  const V ours = rotationOf<double>(rodriguesOf(assume<Normal3<AcquisitionSpace, double>>(n0))).col(2);
  const auto apart = [&](const V& v) { return v.allFinite() ? inDegrees((v - n0).norm()) : kNoAnswer; };
  return {apart(paper), apart(ours)};
}

// Frame of the paper, Eqs. 7 to 9, in single precision and as written.
std::optional<Mat3<double>> paperFrame(const V& u, const V& v) {
  const Vec3<float> uf = u.cast<float>(), vf = v.cast<float>();
  const Vec3<float> n = uf.cross(vf) / uf.cross(vf).norm(),
                    b = (uf.normalized() + vf.normalized()).normalized();
  const float half = 1 / std::sqrt(2.f);
  Mat3<float> frame;
  frame << half * (b + b.cross(n)), half * (b + n.cross(b)), n;
  return frame.cast<double>();
}
std::optional<Mat3<double>> polarMatrix(const V& u, const V& v) {
  const auto frame = polarFrame<double>(u, v);
  if (!frame) return std::nullopt;
  Mat3<double> matrix;
  matrix << frame->u, frame->v, frame->n;
  return matrix;
}

// Largest distance of L L^T from the identity, for tangents at an angle; a surfel without a frame is flagged
// and counts as 0.
Measured tangentsAt(double angle) {
  std::mt19937 random(1);
  Measured worst;
  for (int trial = 0; trial < 200; ++trial) {
    const Mat3<double> turn = randomRotation(random);
    const V u = (turn * V(1, 0, 0)).cast<float>().cast<double>();
    const V v = (turn * V(std::cos(angle), std::sin(angle), 0)).cast<float>().cast<double>();
    const auto violation = [](const std::optional<Mat3<double>>& f) {
      return f ? largestEntry(*f * f->transpose() - Mat3<double>::Identity()) : 0;
    };
    raise(worst.naive, violation(paperFrame(u, v)));
    raise(worst.ours, violation(polarMatrix(u, v)));
  }
  return worst;
}

// Largest turn of L as u0 is chosen otherwise, under a stretch of the tangent plane.
Measured freeTangent(double stretch) {
  Measured worst;
  const Mat3<double> warp = V(stretch, 1, 1).asDiagonal();
  const auto lookUp = [&](double turn, auto frameOf) {
    const Mat3<double> r0 = Eigen::AngleAxisd(turn, V::UnitZ()).toRotationMatrix();
    const auto frame = frameOf(V(warp * r0.col(0)), V(warp * r0.col(1)));
    return frame ? Mat3<double>(r0 * frame->transpose()) : Mat3<double>::Constant(kNoAnswer);
  };
  for (int i = 1; i < 180; ++i) {
    const double turn = std::numbers::pi * i / 180;
    raise(worst.naive, turnBetween(lookUp(turn, paperFrame), lookUp(0, paperFrame)));
    raise(worst.ours, turnBetween(lookUp(turn, polarMatrix), lookUp(0, polarMatrix)));
  }
  return worst;
}

SurfelCloud sphereCloud() {
  testing::Rng rng(3);
  return testing::unitSphere(2000, rng);
}

// Surfels without a finite L that are not flagged as dead.
Measured collapsed(const warp::Warp& warp) {
  const SurfelCloud cloud = sphereCloud();
  const DeformedCloud deformed = warp::deform(cloud, warp);
  Measured count;
  for (size_t i = 0; i < cloud.size(); ++i) {
    const Mat3<double> r0 = rotationOf<double>(cloud.r0[i]);
    const V p = cloud.p0[i].raw().cast<double>();
    const auto j = warp.jacobian(p);
    const Mat3<double> tangents = j ? Mat3<double>(*j * r0) : warp::centralDifferences(warp, p, r0, 1e-4);
    const auto naive = paperFrame(tangents.col(0), tangents.col(1));
    count.naive += !naive->allFinite();
    if (deformed.handedness[i] == Handedness::dead) continue;
    const auto ours = polarMatrix(deformed.u[i].raw().cast<double>(), deformed.v[i].raw().cast<double>());
    count.ours += !ours || !ours->allFinite();
  }
  return count;
}

// Largest angle between the outward normal of the warped surface and the direction that L takes to n0,
// degrees.
Measured outward(const warp::Warp& warp) {
  const SurfelCloud cloud = sphereCloud();
  const DeformedCloud deformed = warp::deform(cloud, warp);
  Measured worst;
  for (size_t i = 0; i < cloud.size(); ++i) {
    if (deformed.handedness[i] == Handedness::dead) continue;
    const Mat3<double> r0 = rotationOf<double>(cloud.r0[i]);
    const auto j = warp.jacobian(cloud.p0[i].raw().cast<double>());
    const V truth = (j->inverse().transpose() * r0.col(2)).normalized(); // cofactor: outward for mirrors, too
    const V u = deformed.u[i].raw().cast<double>(), v = deformed.v[i].raw().cast<double>();
    const auto paper = paperFrame(u, v);
    raise(worst.naive, inDegrees(2 * std::asin(std::min(1.0, (paper->col(2) - truth).norm() / 2))));
    const LookUp<double> lookUp(r0, *polarFrame<double>(u, v), static_cast<double>(deformed.handedness[i]));
    raise(worst.ours, inDegrees((lookUp.outwardNormal().raw() - truth).norm()));
  }
  return worst;
}

warp::WarpPointer formulas(const std::string& x, const std::string& y, const std::string& z) {
  return warp::expressionWarp(warp::Expression(x, warp::warpVariables),
                              warp::Expression(y, warp::warpVariables),
                              warp::Expression(z, warp::warpVariables), {});
}

// Error of tangents under a wave, in degrees, for a patch of the given size at the given place. Naive: Eq. 6
// with a fixed epsilon, and with places in single precision if `single`.
Measured tangentsOfWave(double size, double place, double epsilon, bool single) {
  const double k = 6 / size, a = 0.1 * size;
  const warp::WarpPointer wave = formulas("x", "y",
                                          "z + " + std::to_string(1e12 * a) + "*1e-12*sin(" +
                                              std::to_string(k) + "*(x - " + std::to_string(place) + "))");
  SurfelCloud cloud;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> within(-size, size);
  for (int i = 0; i < 300; ++i) {
    const double x = within(random), y = within(random);
    testing::addSurfel(cloud, V(place + x, y, 0), V(0, 0, 1));
  }
  const DeformedCloud deformed = warp::deform(cloud, *wave);
  Measured worst;
  for (size_t i = 0; i < cloud.size(); ++i) {
    const V p = cloud.p0[i].raw().cast<double>();
    const V truth = V(1, 0, a * k * std::cos(k * (p[0] - place))).normalized();
    V plus = wave->position(p + epsilon * V::UnitX()), minus = wave->position(p - epsilon * V::UnitX());
    if (single) {
      plus = wave->position((p + epsilon * V::UnitX()).cast<float>().cast<double>())
                 .cast<float>()
                 .cast<double>();
      minus = wave->position((p - epsilon * V::UnitX()).cast<float>().cast<double>())
                  .cast<float>()
                  .cast<double>();
    }
    const V naive = plus - minus;
    raise(worst.naive, naive.norm() > 0 ? inDegrees((naive.normalized() - truth).norm()) : kNoAnswer);
    raise(worst.ours, inDegrees((deformed.u[i].raw().cast<double>().normalized() - truth).norm()));
  }
  return worst;
}

// A single surfel whose warp is not a number: values of the deformed cloud that are not finite.
Measured nanAtOneSurfel() {
  const SurfelCloud cloud = sphereCloud();
  const auto& p = cloud.p0[100];
  const warp::WarpPointer warp = formulas("abs(x - " + std::to_string(p.x()) + ") + abs(y - " +
                                              std::to_string(p.y()) + ") < 1e-5 ? sqrt(-1 - x^2) : x",
                                          "y", "z");
  const DeformedCloud deformed = warp::deform(cloud, *warp);
  Measured count;
  for (size_t i = 0; i < cloud.size(); ++i) {
    count.naive += !warp->position(cloud.p0[i].raw().cast<double>()).allFinite();
    count.ours += !deformed.p[i].raw().allFinite() || !deformed.u[i].raw().allFinite();
  }
  // The surfel must be dead, and it alone.
  if (std::ranges::count(deformed.handedness, Handedness::dead) != 1) count.ours = kNoAnswer;
  return count;
}

// The second kind of error of the paper: L turns over the object, and is off by the rotation gradient times
// the gap between where it is evaluated and where it is used.
Measured rotationGradient(double gap) {
  constexpr double degreesPerUnit = 90;
  const warp::WarpPointer twist = warp::twistWarp(V::UnitZ(), Angle::fromDegrees(degreesPerUnit), V::Zero());
  // Axis on which the twist is a pure rotation.
  const auto lookUpAt = [&](double z) { return Mat3<double>(twist->jacobian(V(0, 0, z))->transpose()); };
  const double spacing = 2.5 / std::sqrt(250000.0); // of surfels on an object of this size
  return {turnBetween(lookUpAt(0), lookUpAt(gap)), turnBetween(lookUpAt(0), lookUpAt(spacing))};
}

} // namespace

Group lookUpGroup() {
  const auto flat = [](const V& factors) {
    return [=] { return collapsed(*warp::scaleWarp(factors, V::Zero())); };
  };
  return {
      "Look-up L",
      "equations 5 to 10 of the paper as printed, in single precision, with a fixed epsilon of 0.001",
      {
          {"n0 = -z", "n0 comes back", "angle, degrees", 1e-12, [] { return storedNormal(0); }},
          {"n0 at 0.0001 rad from -z", "n0 comes back", "angle, degrees", 1e-9,
           [] { return storedNormal(1e-4); }},
          {"n0 at 0.001 rad from -z", "n0 comes back", "angle, degrees", 1e-8,
           [] { return storedNormal(1e-3); }},
          {"tangents 0.001 rad from opposite", "L is orthogonal", "largest of L L^T - I", 1e-12,
           [] { return tangentsAt(std::numbers::pi - 1e-3); }},
          {"tangents 1e-6 rad from opposite", "L is orthogonal", "largest of L L^T - I", 1.5e-9,
           [] { return tangentsAt(std::numbers::pi - 1e-6); }},
          {"tangents 1e-6 rad apart", "L is orthogonal", "largest of L L^T - I", 1.5e-9,
           [] { return tangentsAt(1e-6); }},
          {"parallel tangents", "flagged as dead", "largest of L L^T - I", 0, [] { return tangentsAt(0); }},
          {"stretch 1 : 4", "L does not depend on u0", "turn, degrees", 1e-13, [] { return freeTangent(4); }},
          {"stretch 1 : 30", "L does not depend on u0", "turn, degrees", 1e-12,
           [] { return freeTangent(30); }},
          {"stretch 1 : 1000", "L does not depend on u0", "turn, degrees", 1e-11,
           [] { return freeTangent(1000); }},
          {"sphere collapsed to a plane", "no frame, or a flag", "surfels without L or flag", 0,
           flat({1, 1, 0})},
          {"sphere collapsed to a line", "flagged as dead", "surfels without L or flag", 0, flat({1, 0, 0})},
          {"sphere collapsed to a point", "flagged as dead", "surfels without L or flag", 0, flat({0, 0, 0})},
          {"mirror", "L points outwards", "angle of normals, degrees", 1e-5,
           [] {
             return outward(*warp::scaleWarp({-1, 1, 1}, V::Zero()));
           }},
          {"bend that turns a third inside out", "L points outwards", "angle of normals, degrees", 2e-5,
           [] { return outward(*warp::bendWarp(V::UnitZ(), V::UnitX(), Angle::fromRadians(3), V::Zero())); }},
          {"object at 1e6 from the origin, wave without a Jacobian", "exact tangents", "angle, degrees", 1e-5,
           [] { return tangentsOfWave(1, 1e6, 1e-3, true); }},
          {"object of size 1e-6", "exact tangents", "angle, degrees", 5e-6,
           [] { return tangentsOfWave(1e-6, 0, 1e-3, false); }},
          {"epsilon of eq. 6 far too small", "exact tangents", "angle, degrees", 5e-6,
           [] { return tangentsOfWave(1, 0, 1e-15, false); }, "1e-15"},
          {"epsilon of eq. 6 far too large", "exact tangents", "angle, degrees", 5e-6,
           [] { return tangentsOfWave(1, 0, 0.5, false); }, "0.5"},
          {"warp that is not a number at one surfel", "that surfel is flagged", "values not finite", 0,
           nanAtOneSurfel},
          {"twist of 90 degrees a unit, L over a gap of 0.01", "L of each surfel", "turn, degrees", 0.46,
           [] { return rotationGradient(0.01); }, "one L for the gap"},
          {"twist of 90 degrees a unit, L over a gap of 0.1", "L of each surfel", "turn, degrees", 0.46,
           [] { return rotationGradient(0.1); }, "one L for the gap"},
          {"twist of 90 degrees a unit, L over a gap of 1", "L of each surfel", "turn, degrees", 0.46,
           [] { return rotationGradient(1); }, "one L for the gap"},
      }};
}

} // namespace surflect::stability
