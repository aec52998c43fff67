#include "warp/motion.h"

#include "surfel/base/error.h"

#include <cassert>
#include <cmath>

namespace surflect::warp {

namespace {

double nonZeroAt(const Track& track, const ShotTime& time, std::string_view field) {
  const double value = finiteAt(track, time, field);
  if (value == 0) throw Error::mismatch("another number", "0").at(field);
  return value;
}

Angle anglePerUnit(const Track& angleDeg, const Track& length, const ShotTime& time) {
  return Angle::fromDegrees(finiteAt(angleDeg, time, "angle_deg") / nonZeroAt(length, time, "length"));
}

WarpPointer frozen(const RigidMotion& m, const ShotTime& time) {
  return rigidWarp(unitAt(m.axis, time, "axis"), Angle::fromDegrees(finiteAt(m.angleDeg, time, "angle_deg")),
                   finiteAt(m.center, time, "center"), finiteAt(m.translate, time, "translate"));
}

WarpPointer frozen(const ScaleMotion& m, const ShotTime& time) {
  return scaleWarp(finiteAt(m.factor, time, "factor"), finiteAt(m.center, time, "center"));
}

WarpPointer frozen(const TwistMotion& m, const ShotTime& time) {
  return twistWarp(unitAt(m.axis, time, "axis"), anglePerUnit(m.angleDeg, m.length, time),
                   finiteAt(m.center, time, "center"));
}

WarpPointer frozen(const BendMotion& m, const ShotTime& time) {
  const Vec3<double> axis = unitAt(m.axis, time, "axis");
  const Vec3<double> wish = unitAt(m.direction, time, "direction");
  const Vec3<double> across = wish - axis.dot(wish) * axis;
  if (across.norm() < 1e-6)
    throw Error::mismatch("one that is not", "a direction along the axis").at("direction");
  // Orthogonalise twice, to remove the rounding error of the first.
  const Vec3<double> direction = (across - axis.dot(across) * axis).normalized();
  return bendWarp(axis, direction, anglePerUnit(m.angleDeg, m.length, time),
                  finiteAt(m.center, time, "center"));
}

double positiveAt(const Track& track, const ShotTime& time, std::string_view field) {
  const double value = finiteAt(track, time, field);
  if (!(value > 0)) throw Error::mismatch("more than 0", numberText(value)).at(field);
  return value;
}

WarpPointer frozen(const TaperMotion& m, const ShotTime& time) {
  const double growth = std::log(positiveAt(m.factor, time, "factor")) / nonZeroAt(m.length, time, "length");
  return taperWarp(unitAt(m.axis, time, "axis"), growth, finiteAt(m.center, time, "center"));
}

WarpPointer frozen(const SineMotion& m, const ShotTime& time) {
  SineWave wave;
  wave.axis = unitAt(m.axis, time, "axis");
  wave.direction = unitAt(m.direction, time, "direction");
  wave.center = finiteAt(m.center, time, "center");
  wave.amplitude = finiteAt(m.amplitude, time, "amplitude");
  wave.wavelength = nonZeroAt(m.wavelength, time, "wavelength");
  wave.phase = Angle::fromDegrees(finiteAt(m.phaseDeg, time, "phase_deg"));
  return sineWarp(wave);
}

WarpPointer frozen(const ExpressionMotion& m, const ShotTime& time) {
  return expressionWarp(m.x, m.y, m.z, time, m.origin);
}

WarpPointer frozen(const LatticeMotion& m, const ShotTime& time) {
  Lattice lattice{finiteAt(m.least, time, "min"), finiteAt(m.most, time, "max"), m.divisions, {}};
  if (!((lattice.most - lattice.least).minCoeff() > 0))
    throw Error::mismatch("more than min along every axis", "no more along one").at("max");
  lattice.moves.assign(lattice.pointCount(), Vec3<double>::Zero());
  for (size_t i = 0; i < m.points.size(); ++i)
    lattice.moves[lattice.pointIndex(m.points[i].index)] =
        finiteAt(m.points[i].move, time, "point[" + std::to_string(i) + "].move");
  return latticeWarp(std::move(lattice));
}

WarpPointer frozen(const HandlesMotion& m, const ShotTime& time) {
  assert(m.targets.size() == m.handles->size());
  std::vector<Vec3<double>> targets;
  for (size_t i = 0; i < m.targets.size(); ++i)
    targets.push_back(finiteAt(m.targets[i], time, "handle[" + std::to_string(i) + "].to"));
  return m.handles->pullTo(targets);
}

WarpPointer frozen(const MeshMotion& m, const ShotTime& time) {
  const bool inSeconds = m.sequence->cacheFormat() == PointCache::Format::mdd;
  return m.sequence->at(finiteAt(m.time, time, inSeconds ? "time" : "frame"));
}

WarpPointer frozen(const SkeletonMotion& m, const ShotTime& time) {
  return m.rig->at(finiteAt(m.seconds, time, "time"));
}

uint64_t hashOf(const SkeletonMotion& m) { return m.rig->contentHash(); }
uint64_t hashOf(const MeshMotion& m) { return m.sequence->contentHash(); }
template <class Motion> uint64_t hashOf(const Motion&) { return 0; }

} // namespace

uint64_t filesHash(const WarpMotion& motion) {
  return std::visit([](const auto& m) { return hashOf(m); }, motion);
}

WarpPointer evaluateAt(const WarpMotion& motion, const ShotTime& time) {
  return std::visit([&](const auto& m) { return frozen(m, time); }, motion);
}

} // namespace surflect::warp
