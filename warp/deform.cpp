#include "warp/deform.h"

#include "warp/deform_kernels.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <utility>

namespace surflect::warp {

namespace {

// Tangents by central differences [Weyrich 2005, Eq. 6], for warps without an exact Jacobian. Rest frames are
// rotations, so n0 = u0 x v0, and the determinant of the three derivatives is that of J.
void carryByDifferences(const Warp& warp, double epsilon, WarpBatch& b) {
  for (int i = 0; i < b.count; ++i) {
    const Vec3<double> x(b.x[i], b.y[i], b.z[i]);
    Mat3<double> frame; // u0, v0, n0
    frame.col(0) << b.ux[i], b.uy[i], b.uz[i];
    frame.col(1) << b.vx[i], b.vy[i], b.vz[i];
    frame.col(2) = frame.col(0).cross(frame.col(1));
    const Mat3<double> along = centralDifferences(warp, x, frame, epsilon);
    const Vec3<double> p = warp.position(x);
    b.x[i] = p.x(), b.y[i] = p.y(), b.z[i] = p.z();
    b.ux[i] = along(0, 0), b.uy[i] = along(1, 0), b.uz[i] = along(2, 0);
    b.vx[i] = along(0, 1), b.vy[i] = along(1, 1), b.vz[i] = along(2, 1);
    b.determinant[i] = along.determinant();
  }
}

static_assert(sizeof(Handedness) == 1 && sizeof(Rodrigues) == 3 * sizeof(float));
template <class Triple> float* floatsFrom(std::vector<Triple>& triples, size_t begin) {
  return reinterpret_cast<float*>(triples.data() + begin);
}
template <class Triple> const float* floatsFrom(const std::vector<Triple>& triples, size_t begin) {
  return reinterpret_cast<const float*>(triples.data() + begin);
}

// Prefetches entries [begin, end). Always inlined: g++ 12 removes calls of a function that only prefetches,
// as having no effect.
template <class Entry>
[[gnu::always_inline]] inline void fetch(const std::vector<Entry>& entries, size_t begin, size_t end) {
  constexpr size_t kLine = 64;
  const char *from = reinterpret_cast<const char*>(entries.data() + begin),
             *to = reinterpret_cast<const char*>(entries.data() + std::min(end, entries.size()));
  for (; from < to; from += kLine) __builtin_prefetch(from);
}

// The surfels from `begin` on; may write up to the next whole group of kWarpGroup.
void finish(const WarpBatch& batch, DeformedCloud& deformed, size_t begin) {
  std::array<uint32_t, WarpBatch::capacity / 32> doubtful;
  finishBatch(batch, floatsFrom(deformed.p, begin), floatsFrom(deformed.u, begin),
              floatsFrom(deformed.v, begin), reinterpret_cast<int8_t*>(deformed.handedness.data() + begin),
              doubtful.data());
  for (size_t word = 0; word < doubtful.size(); ++word)
    for (uint32_t bits = doubtful[word]; bits != 0; bits &= bits - 1) {
      const size_t i = 32 * word + static_cast<size_t>(std::countr_zero(bits)), at = begin + i;
      if (i >= static_cast<size_t>(batch.count)) break;
      const Vec3<float> p = deformed.p[at].raw(), u = deformed.u[at].raw(), v = deformed.v[at].raw();
      if (p.allFinite() && u.allFinite() && v.allFinite() && std::isfinite(batch.determinant[i]) &&
          polarFrame(u, v))
        continue;
      deformed.p[at] = {};
      deformed.u[at] = deformed.v[at] = {};
      deformed.handedness[at] = Handedness::dead;
    }
}

// A copy of the surfels of a batch.
class DeformedBatch {
public:
  DeformedBatch(const DeformedCloud& cloud, size_t begin, size_t end) : count_(end - begin) {
    copy(cloud.p, begin, p_), copy(cloud.u, begin, u_), copy(cloud.v, begin, v_);
    copy(cloud.handedness, begin, handedness_);
  }
  // Whether a cloud has the same bits from `begin` on.
  bool isIn(const DeformedCloud& cloud, size_t begin) const {
    return equals(cloud.p, begin, p_) && equals(cloud.u, begin, u_) && equals(cloud.v, begin, v_) &&
           equals(cloud.handedness, begin, handedness_);
  }

private:
  template <class T> using Bytes = std::array<std::byte, WarpBatch::capacity * sizeof(T)>;
  template <class T> void copy(const std::vector<T>& from, size_t begin, Bytes<T>& to) const {
    std::memcpy(to.data(), from.data() + begin, count_ * sizeof(T));
  }
  template <class T> bool equals(const std::vector<T>& all, size_t begin, const Bytes<T>& kept) const {
    return std::memcmp(kept.data(), all.data() + begin, count_ * sizeof(T)) == 0;
  }

  size_t count_;
  Bytes<Point3<ObjectSpace>> p_;
  Bytes<Direction3<ObjectSpace>> u_, v_;
  Bytes<Handedness> handedness_;
};

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

DeformedCloud deform(const SurfelCloud& cloud, const Warp& warp, const Progress& progress,
                     DeformedCloud kept) {
  deformInto(cloud, warp, progress, kept);
  return kept;
}

bool deformInto(const SurfelCloud& cloud, const Warp& warp, const Progress& progress,
                DeformedCloud& deformed) {
  const size_t count = cloud.size();
  const bool exact = count == 0 || warp.jacobian(cloud.p0[0].raw().cast<double>());
  const double epsilon = exact ? 0 : differenceStep(cloud);
  std::atomic<bool> hasChanged = deformed.size() != count;
  const auto resize = [&](size_t size) {
    deformed.p.resize(size);
    deformed.u.resize(size);
    deformed.v.resize(size);
    deformed.handedness.resize(size);
  };
  const auto deformBatch = [&](size_t begin, size_t end) {
    WarpBatch batch;
    beginBatch(floatsFrom(cloud.p0, begin), floatsFrom(cloud.r0, begin), static_cast<int>(end - begin),
               batch);
    fetch(deformed.p, begin, end);
    fetch(deformed.u, begin, end);
    fetch(deformed.v, begin, end);
    fetch(deformed.handedness, begin, end);
    fetch(cloud.p0, end, end + WarpBatch::capacity);
    fetch(cloud.r0, end, end + WarpBatch::capacity);
    if (exact)
      warp.carry(batch);
    else
      carryByDifferences(warp, epsilon, batch);
    if (hasChanged.load(std::memory_order_relaxed)) return finish(batch, deformed, begin);
    const DeformedBatch before(deformed, begin, end);
    finish(batch, deformed, begin);
    if (!before.isIn(deformed, begin)) hasChanged.store(true, std::memory_order_relaxed);
  };
  resize((count + kWarpGroup - 1) / kWarpGroup * kWarpGroup);
  constexpr size_t atOnce = WarpBatch::capacity;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, (count + atOnce - 1) / atOnce, 8),
                    [&](const tbb::blocked_range<size_t>& batches) {
                      progress.checkpoint();
                      for (size_t i = batches.begin(); i < batches.end(); ++i)
                        deformBatch(i * atOnce, std::min(count, (i + 1) * atOnce));
                    });
  resize(count);
  return hasChanged;
}

Mesh<ObjectSpace> deform(const TriangleMesh& mesh, const Warp& warp) {
  Mesh<ObjectSpace> deformed{std::vector<Point3<ObjectSpace>>(mesh.positions.size()), mesh.triangles};
  tbb::parallel_for(size_t{0}, mesh.positions.size(), [&](size_t i) {
    const Vec3<double> rest = mesh.positions[i].cast<double>().raw();
    deformed.positions[i] = assume<Point3<ObjectSpace>>(warp.position(rest));
  });
  return deformed;
}

} // namespace surflect::warp
