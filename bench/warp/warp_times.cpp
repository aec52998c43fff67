#include "bench/warp/warp_times.h"

#include "bench/plain_splats/doll_cloud.h"
#include "surfel/base/error.h"
#include "surfel/math/bounds.h"
#include "warp/deform.h"
#include "warp/lattice.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

namespace surflect::bench {

namespace {

// A warp as the paper uses it: five evaluations of Psi a surfel, one for p and two each for u and v
// [Weyrich 2005, Eq. 6]. They do not say whether it mirrors.
DeformedCloud deformByDifferences(const SurfelCloud& cloud, const warp::Warp& warp, DeformedCloud deformed) {
  const double epsilon = warp::differenceStep(cloud);
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
struct PointByPoint final : warp::Warp {
  explicit PointByPoint(const warp::Warp& of) : warp(of) {}
  Vec3<double> position(const Vec3<double>& x) const override { return warp.position(x); }
  std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const override { return warp.jacobian(x); }
  const warp::Warp& warp;
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
  std::function<DeformedCloud(DeformedCloud kept)> deform; // into memory that is there
  DeformedCloud result = {};
  std::vector<Lap> laps = {};
};

std::vector<WarpTimes> timesOfWarp(const char* name, const SurfelCloud& cloud, const warp::Warp& warp,
                                   int rounds) {
  constexpr double kFarthest = 3e-7; // coordinates are of a doll about one unit high
  const PointByPoint plain(warp);
  std::vector<Way> ways;
  ways.push_back(
      {"differences", [&](DeformedCloud kept) { return deformByDifferences(cloud, warp, std::move(kept)); }});
  ways.push_back({"exact", [&](DeformedCloud kept) {
                    return warp::deform(cloud, plain, {}, bestSimd(), std::move(kept));
                  }});
  for (const Simd simd : supportedSimd())
    ways.push_back({std::string(nameOf(simd)), [&, simd](DeformedCloud kept) {
                      return warp::deform(cloud, warp, {}, simd, std::move(kept));
                    }});
  const DeformedCloud expected = ways[1].deform({});
  for (Way& way : ways) {
    way.result = way.deform(way.deform({}));
    if (const double off = distance(way.result, expected); !(off < kFarthest))
      throw Error(fmt::format("{} by {}: {} from the exact", name, way.name, off));
  }
  for (int round = 0; round < rounds; ++round)
    for (Way& way : ways) way.laps.push_back(lapOf([&] { way.result = way.deform(std::move(way.result)); }));
  std::vector<WarpTimes> times;
  for (const Way& way : ways) times.push_back({name, way.name, cloud.size(), timesOf(way.laps)});
  return times;
}

// Four control points along each axis, each moved by up to 5 % of the box.
warp::WarpPointer latticeAround(const Eigen::AlignedBox3d& box) {
  warp::Lattice lattice{box.min(), box.max(), {3, 3, 3}, {}};
  const Vec3<double> size = box.sizes();
  for (int i = 0; i < 64; ++i)
    lattice.moves.push_back(0.05 *
                            size.cwiseProduct(Vec3<double>(std::sin(i), std::sin(2 * i), std::cos(i))));
  return warp::latticeWarp(std::move(lattice));
}

} // namespace

std::vector<WarpTimes> timeWarps(int rounds) {
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  const SurfelCloud cloud = dollCloud(kDollSurfels, SurfelOrder::coherent).rest;
  const Eigen::AlignedBox3d box = boundsOf(cloud.p0);
  const warp::WarpPointer twist =
      warp::twistWarp(Vec3<double>::UnitZ(), Angle::fromDegrees(40 / box.sizes()[2]), box.center());
  std::vector<WarpTimes> times = timesOfWarp("twist", cloud, *twist, rounds);
  std::ranges::move(timesOfWarp("lattice", cloud, *latticeAround(box), rounds), std::back_inserter(times));
  return times;
}

} // namespace surflect::bench
