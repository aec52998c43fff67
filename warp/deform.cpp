#include "warp/deform.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace surflect {

namespace {

struct DeformedSurfel {
  Point3<ObjectSpace> p;
  Direction3<ObjectSpace> u, v;
  Handedness handedness = Handedness::dead;
};

DeformedSurfel deformSurfel(const Vec3<double>& p0, const Rodrigues& r0, const Warp& warp, double epsilon) {
  const Mat3<double> frame = rotationOf<double>(r0); // u0, v0, n0
  const auto exact = warp.jacobian(p0);
  const Mat3<double> along =
      exact ? Mat3<double>(*exact * frame) : centralDifferences(warp, p0, frame, epsilon);
  const Vec3<float> p = warp.position(p0).cast<float>();
  const Vec3<float> u = along.col(0).cast<float>(), v = along.col(1).cast<float>();

  const double determinant = along.determinant(); // of J: the frame is a rotation
  const bool alive = p.allFinite() && u.allFinite() && v.allFinite() && std::isfinite(determinant);
  if (!alive || !polarFrame(u, v)) return {};
  return {assume<Point3<ObjectSpace>>(p), assume<Direction3<ObjectSpace>>(u),
          assume<Direction3<ObjectSpace>>(v), determinant < 0 ? Handedness::mirrored : Handedness::kept};
}

} // namespace

double differenceStep(const SurfelCloud& cloud) {
  Eigen::AlignedBox3d box;
  for (const Point3<AcquisitionSpace>& p0 : cloud.p0)
    if (p0.raw().allFinite()) box.extend(p0.raw().cast<double>());
  const double farthest =
      box.isEmpty() ? 0 : std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
  if (farthest == 0) return std::cbrt(3 * 0x1p-53 / 256);
  const double diagonal = box.diagonal().norm();
  const double feature = (diagonal > 0 ? diagonal : farthest) / 16;
  return std::cbrt(3 * 0x1p-53 * farthest * feature * feature);
}

DeformedCloud deform(const SurfelCloud& cloud, const Warp& warp, const Progress& progress) {
  const size_t count = cloud.size();
  const double epsilon = differenceStep(cloud);
  DeformedCloud deformed;
  deformed.p.resize(count);
  deformed.u.resize(count);
  deformed.v.resize(count);
  deformed.handedness.resize(count);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 1024), [&](const tbb::blocked_range<size_t>& range) {
    progress.checkpoint();
    for (size_t i = range.begin(); i < range.end(); ++i) {
      const DeformedSurfel surfel =
          deformSurfel(cloud.p0[i].raw().cast<double>(), cloud.r0[i], warp, epsilon);
      deformed.p[i] = surfel.p;
      deformed.u[i] = surfel.u;
      deformed.v[i] = surfel.v;
      deformed.handedness[i] = surfel.handedness;
    }
  });
  return deformed;
}

Mesh<ObjectSpace> deform(const TriangleMesh& mesh, const Warp& warp) {
  Mesh<ObjectSpace> deformed{std::vector<Point3<ObjectSpace>>(mesh.positions.size()), mesh.triangles};
  tbb::parallel_for(size_t{0}, mesh.positions.size(), [&](size_t i) {
    const Vec3<double> rest = mesh.positions[i].cast<double>().raw();
    deformed.positions[i] = assume<Point3<ObjectSpace>>(warp.position(rest));
  });
  return deformed;
}

} // namespace surflect
