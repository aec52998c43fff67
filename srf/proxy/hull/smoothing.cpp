#include "srf/proxy/hull/smoothing.h"

#include <tbb/parallel_for.h>

#include <vector>

namespace surflect::hull {

namespace {

// Vertex neighbours. In a closed, consistently wound mesh each half-edge a -> b is in one triangle, so every
// edge is found once from each end.
struct Neighbors {
  std::vector<size_t> start;
  std::vector<uint32_t> vertices; // those of vertex i from start[i] to start[i + 1]

  explicit Neighbors(const TriangleMesh& mesh) : start(mesh.positions.size() + 1, 0) {
    for (const auto& triangle : mesh.triangles)
      for (const uint32_t corner : triangle) ++start[corner + 1];
    for (size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
    vertices.resize(start.back());
    std::vector<size_t> next(start.begin(), start.end() - 1);
    for (const auto& triangle : mesh.triangles)
      for (size_t c = 0; c < 3; ++c) vertices[next[triangle[c]]++] = triangle[(c + 1) % 3];
  }
};

} // namespace

TriangleMesh smoothed(TriangleMesh mesh, int pairs, const Progress& progress) {
  const Neighbors neighbors(mesh);
  std::vector<Point3<AcquisitionSpace>> moved(mesh.positions.size());
  for (int step = 0; step < 2 * pairs; ++step) {
    progress.checkpoint();
    const double strength = step % 2 == 0 ? 0.5 : -0.53;
    tbb::parallel_for(size_t{0}, moved.size(), [&](size_t i) {
      const Vec3<double> p = mesh.positions[i].cast<double>().raw();
      Vec3<double> offset = Vec3<double>::Zero();
      for (size_t n = neighbors.start[i]; n < neighbors.start[i + 1]; ++n)
        offset += mesh.positions[neighbors.vertices[n]].cast<double>().raw() - p;
      const auto count = static_cast<double>(neighbors.start[i + 1] - neighbors.start[i]);
      moved[i] = assume<Point3<AcquisitionSpace>>(Vec3<double>(p + strength / count * offset));
    });
    mesh.positions.swap(moved);
  }
  return mesh;
}

} // namespace surflect::hull
