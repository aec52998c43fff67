#include "surfel/mesh.h"

#include "surfel/error.h"
#include "surfel/obj.h"
#include "surfel/ply.h"

#include <algorithm>
#include <string>

namespace surflect {

namespace {

uint32_t vertexIndex(double value, size_t vertices, size_t item) {
  if (!(value >= 0) || value >= static_cast<double>(vertices))
    throw Error::mismatch("an index below " + std::to_string(vertices), std::to_string(value))
        .at("[" + std::to_string(item) + "]");
  return static_cast<uint32_t>(value);
}

void addFaces(const PlyProperty& lists, TriangleMesh& mesh, const Progress& progress) {
  for (size_t f = 0; f + 1 < lists.start.size(); ++f) {
    progress.checkNowAndThen(f);
    auto corner = [&](size_t i) { return vertexIndex(lists.values[i], mesh.positions.size(), f); };
    for (size_t i = lists.start[f] + 2; i < lists.start[f + 1]; ++i)
      mesh.triangles.push_back({corner(lists.start[f]), corner(i - 1), corner(i)});
  }
}

// A strip turns its winding at every triangle; -1 starts a new one.
void addStrips(const PlyProperty& lists, TriangleMesh& mesh, const Progress& progress) {
  for (size_t s = 0; s + 1 < lists.start.size(); ++s) {
    std::vector<uint32_t> strip;
    for (size_t i = lists.start[s]; i < lists.start[s + 1]; ++i) {
      if (lists.values[i] == -1) {
        strip.clear();
        continue;
      }
      progress.checkNowAndThen(i);
      strip.push_back(vertexIndex(lists.values[i], mesh.positions.size(), s));
      if (const size_t n = strip.size(); n >= 3)
        mesh.triangles.push_back(n % 2 ? std::array{strip[n - 3], strip[n - 2], strip[n - 1]}
                                       : std::array{strip[n - 2], strip[n - 3], strip[n - 1]});
    }
  }
}

TriangleMesh readPlyMesh(const std::filesystem::path& path, const Progress& progress,
                         const Vec3<double>& origin) {
  const PlyFile ply = readPly(path, progress);
  try {
    TriangleMesh mesh;
    const PlyElement* vertices = ply.find("vertex");
    if (!vertices) throw Error::mismatch("an element 'vertex'", "none");
    const auto x = vertices->scalars("x"), y = vertices->scalars("y"), z = vertices->scalars("z");
    for (size_t i = 0; i < vertices->count; ++i) {
      progress.checkNowAndThen(i);
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(
          Vec3<float>((Vec3<double>(x[i], y[i], z[i]) - origin).cast<float>())));
      if (!mesh.positions.back().raw().allFinite())
        throw Error::mismatch("finite coordinates",
                              numberText(x[i]) + ' ' + numberText(y[i]) + ' ' + numberText(z[i]))
            .at("vertex[" + std::to_string(i) + "]");
    }
    for (const auto& [element, add] : {std::pair{"face", &addFaces}, std::pair{"tristrips", &addStrips}})
      if (const PlyElement* found = ply.find(element))
        for (const char* name : {"vertex_indices", "vertex_index"})
          if (const PlyProperty* lists = found->find(name); lists && lists->isList) {
            try {
              add(*lists, mesh, progress);
            } catch (Error& error) {
              throw std::move(error).at(element);
            }
          }
    return mesh;
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace

Vec3<double> areaVector(const TriangleMesh& mesh, size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vec3<double> pa = mesh.positions[a].cast<double>().raw();
  return (mesh.positions[b].cast<double>().raw() - pa).cross(mesh.positions[c].cast<double>().raw() - pa);
}

TriangleMesh readMeshAsStored(const std::filesystem::path& path, const Progress& progress,
                              const Vec3<double>& origin) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  if (extension == ".obj") return readObj(path, progress, origin);
  if (extension == ".ply" || extension.empty()) return readPlyMesh(path, progress, origin);
  throw Error::mismatch("a mesh as .ply or .obj", extension).in(path);
}

TriangleMesh withoutFlat(TriangleMesh mesh, const Progress& progress) {
  TriangleMesh solid{std::move(mesh.positions), {}};
  for (const auto& triangle : mesh.triangles) {
    progress.checkNowAndThen(solid.triangles.size());
    solid.triangles.push_back(triangle);
    if (!(areaVector(solid, solid.triangles.size() - 1).norm() > 0)) solid.triangles.pop_back();
  }
  if (solid.triangles.empty()) throw Error::mismatch("triangles", "none that has an area");
  return solid;
}

TriangleMesh readMesh(const std::filesystem::path& path, const Progress& progress,
                      const Vec3<double>& origin) {
  TriangleMesh stored = readMeshAsStored(path, progress, origin);
  try {
    return withoutFlat(std::move(stored), progress);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace surflect
