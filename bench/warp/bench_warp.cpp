// bench_warp [ROUNDS]: nanoseconds a surfel to warp the doll of bench/splat on one thread: by finite
// differences, point by point with exact Jacobians, and in lanes, in turns, after checking that all agree.

#include "bench/splat/doll_cloud.h"
#include "surfel/bounds.h"
#include "warp/deform.h"
#include "warp/lattice.h"

#include <fmt/core.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <functional>

namespace surflect {
namespace {

// Of the processor: what counts where others share the machine.
double nanoseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e9 * static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec);
}

// A warp as the paper uses it: five evaluations of Psi a surfel, one for p and two each for u and v
// [Weyrich 2005, Eq. 6]. They do not say whether it mirrors.
DeformedCloud deformByDifferences(const SurfelCloud& cloud, const Warp& warp) {
  const double epsilon = differenceStep(cloud);
  DeformedCloud deformed;
  deformed.p.resize(cloud.size());
  deformed.u.resize(cloud.size());
  deformed.v.resize(cloud.size());
  deformed.handedness.assign(cloud.size(), Handedness::kept);
  for (size_t i = 0; i < cloud.size(); ++i) {
    const Vec3<double> x = cloud.p0[i].raw().cast<double>();
    const Mat3<double> frame = rotationOf<double>(cloud.r0[i]);
    const auto along = [&](int axis) {
      const Vec3<double> offset = epsilon * frame.col(axis);
      const Vec3<double> d = (warp.position(x + offset) - warp.position(x - offset)) / (2 * epsilon);
      return assume<Direction3<ObjectSpace>>(d);
    };
    deformed.p[i] = assume<Point3<ObjectSpace>>(warp.position(x));
    deformed.u[i] = along(0);
    deformed.v[i] = along(1);
  }
  return deformed;
}

// The same warp, whose kernels nobody knows.
struct PointByPoint final : Warp {
  explicit PointByPoint(const Warp& of) : warp(of) {}
  Vec3<double> position(const Vec3<double>& x) const override { return warp.position(x); }
  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override { return warp.jacobian(x); }
  const Warp& warp;
};

// The largest difference of two coordinates.
double distance(const DeformedCloud& a, const DeformedCloud& b) {
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i)
    for (const float d : {(a.p[i] - b.p[i]).raw().lpNorm<Eigen::Infinity>(),
                          (a.u[i].raw() - b.u[i].raw()).lpNorm<Eigen::Infinity>(),
                          (a.v[i].raw() - b.v[i].raw()).lpNorm<Eigen::Infinity>()})
      largest = std::max(largest, double{d});
  return largest;
}

struct Way {
  std::string name;
  std::function<DeformedCloud()> deform;
  std::vector<double> times;
};

bool measure(const char* name, const SurfelCloud& cloud, const Warp& warp, int rounds) {
  const PointByPoint plain(warp);
  std::vector<Way> ways{{"differences", [&] { return deformByDifferences(cloud, warp); }, {}},
                        {"exact", [&] { return deform(cloud, plain); }, {}}};
  for (const Simd simd : supportedSimd())
    ways.push_back({std::string(nameOf(simd)), [&, simd] { return deform(cloud, warp, {}, simd); }, {}});
  const DeformedCloud expected = ways[1].deform();
  for (Way& way : ways) {
    const double off = distance(way.deform(), expected);
    if (!(off < 3e-7)) {
      fmt::print("{} by {}: {} from the exact\n", name, way.name, off);
      return false;
    }
  }
  for (int round = 0; round < rounds; ++round)
    for (Way& way : ways) {
      const double begin = nanoseconds();
      way.deform();
      way.times.push_back(nanoseconds() - begin);
    }
  std::vector<double> each;
  for (Way& way : ways) {
    std::ranges::sort(way.times);
    each.push_back(way.times[way.times.size() / 2] / static_cast<double>(cloud.size()));
    fmt::print("{:8} {:12} {:7.2f} ns a surfel, least {:7.2f}; {:6.1f} times as fast as differences\n", name,
               way.name, each.back(), way.times.front() / static_cast<double>(cloud.size()),
               each.front() / each.back());
  }
  return true;
}

// Four control points along each axis, each moved by up to 5 % of the box.
WarpPointer latticeAround(const Eigen::AlignedBox3d& box) {
  Lattice lattice{box.min(), box.max(), {3, 3, 3}, {}};
  const Vec3<double> size = box.sizes();
  for (int i = 0; i < 64; ++i)
    lattice.moves.push_back(0.05 *
                            size.cwiseProduct(Vec3<double>(std::sin(i), std::sin(2 * i), std::cos(i))));
  return latticeWarp(std::move(lattice));
}

int run(int rounds) {
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  const SurfelCloud cloud = dollCloud(kDollSurfels, SurfelOrder::coherent).rest;
  const Eigen::AlignedBox3d box = boundsOf(cloud.p0);
  const WarpPointer twist =
      twistWarp(Vec3<double>::UnitZ(), Angle::fromDegrees(40 / box.sizes()[2]), box.center());
  fmt::print("{} surfels, one thread\n", cloud.size());
  return measure("twist", cloud, *twist, rounds) && measure("lattice", cloud, *latticeAround(box), rounds)
             ? 0
             : 1;
}

} // namespace
} // namespace surflect

int main(int argc, char** argv) { return surflect::run(argc > 1 ? std::max(1, std::atoi(argv[1])) : 9); }
