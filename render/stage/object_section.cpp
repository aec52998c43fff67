#include "render/stage/object_section.h"

#include "render/stage/curve.h"
#include "render/stage/shapes.h"
#include "render/stage/stage_plan.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/geometry/obj.h"
#include "surfel/geometry/ply.h"
#include "surfel/math/space.h"
#include "warp/gltf.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <optional>
#include <string>

namespace surflect::stage {

using Vector = Vec3<double>;
using Direction = Direction3<AcquisitionSpace, double>;

namespace {

struct MeshFile {
  TexturedMesh mesh;
  uint64_t hash;
};

MeshFile readTexturedMesh(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  if (extension == ".gltf" || extension == ".glb") {
    warp::GltfMesh file = warp::readGltfMesh(path);
    return {std::move(file.mesh), file.contentHash};
  }
  const std::string bytes = readFile(path);
  const uint64_t hash = contentHash(std::as_bytes(std::span(bytes)));
  if (extension == ".obj") return {readTexturedObj(path), hash};
  if (extension == ".ply" || extension.empty()) return {readTexturedPly(path), hash};
  throw Error::mismatch("a mesh as .ply, .obj, .gltf or .glb", extension).in(path);
}

void removeFlatTriangles(TriangleMesh& mesh, const std::filesystem::path& path) {
  const TriangleMesh stored = mesh;
  mesh.triangles.clear();
  for (size_t i = 0; i < stored.triangles.size(); ++i)
    if (areaVector(stored, i).norm() > 0) mesh.triangles.push_back(stored.triangles[i]);
  if (mesh.triangles.empty()) throw Error::mismatch("triangles", "none that has an area").in(path);
}

// Flips triangles whose corner normals all point to the back: exporters mirror triangles without their
// normals.
void windByNormals(TexturedMesh& mesh) {
  if (mesh.normals.empty()) return;
  for (size_t i = 0; i < mesh.mesh.triangles.size(); ++i) {
    const Vector area = areaVector(mesh.mesh, i);
    auto& triangle = mesh.mesh.triangles[i];
    if (std::ranges::all_of(triangle, [&](uint32_t v) { return mesh.normals[v].dot(area) < 0; }))
      std::swap(triangle[1], triangle[2]);
  }
}

// Mesh with separate vertices for each triangle.
TexturedMesh unshared(const TexturedMesh& mesh) {
  TexturedMesh apart;
  for (const auto& triangle : mesh.mesh.triangles) {
    const auto first = static_cast<uint32_t>(apart.mesh.positions.size());
    for (const uint32_t vertex : triangle) {
      apart.corner.push_back(static_cast<uint32_t>(apart.corner.size()));
      apart.mesh.positions.push_back(mesh.mesh.positions[vertex]);
      if (!mesh.textureCoordinates.empty())
        apart.textureCoordinates.push_back(mesh.textureCoordinates[vertex]);
    }
    apart.mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return apart;
}

std::vector<Vector> meanNormals(const TexturedMesh& mesh) {
  std::vector<Vector> sums(1 + static_cast<size_t>(*std::ranges::max_element(mesh.corner)), Vector::Zero());
  for (size_t i = 0; i < mesh.mesh.triangles.size(); ++i)
    for (const uint32_t vertex : mesh.mesh.triangles[i])
      sums[mesh.corner[vertex]] += areaVector(mesh.mesh, i);
  std::vector<Vector> normals;
  for (const uint32_t corner : mesh.corner) normals.push_back(sums[corner]);
  return normals;
}

// Twice the area times dp/ds, with p the triangle's map from its texture. For edges d, e with texture
// differences, d = ds p_s + dt p_t, so d e_t - e d_t = (d_s e_t - e_s d_t) p_s. Mirrored textures flip the
// sign; 0 without such a direction.
Vector alongTexture(const TexturedMesh& mesh, const std::array<uint32_t, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  const auto edge = [&](uint32_t to) -> Vector {
    return mesh.mesh.positions[to].cast<double>().raw() - mesh.mesh.positions[a].cast<double>().raw();
  };
  const auto& st = mesh.textureCoordinates;
  const Vec2<double> d = st[b] - st[a], e = st[c] - st[a];
  const double determinant = d.x() * e.y() - e.x() * d.y();
  if (!(std::abs(determinant) > 0)) return Vector::Zero();
  return (determinant < 0 ? -1. : 1.) * (e.y() * edge(b) - d.y() * edge(c));
}

// Replaces vectors by the file's, where it has any.
void replaceByThoseThere(std::vector<Vector>& vectors, const std::vector<Vector>& ofFile) {
  for (size_t i = 0; i < ofFile.size(); ++i)
    if (ofFile[i].squaredNorm() > 0) vectors[i] = ofFile[i];
}

std::vector<Vector> meanTangents(const TexturedMesh& mesh) {
  std::vector<Vector> sums(mesh.mesh.positions.size(), Vector::Zero());
  if (mesh.textureCoordinates.empty()) return sums;
  for (const auto& triangle : mesh.mesh.triangles) {
    const Vector along = alongTexture(mesh, triangle);
    for (const uint32_t vertex : triangle) sums[vertex] += along;
  }
  return sums;
}

} // namespace

SurfaceFile readSurface(const std::filesystem::path& path, bool smooth) {
  auto [mesh, hash] = readTexturedMesh(path);
  removeFlatTriangles(mesh.mesh, path);
  windByNormals(mesh);
  if (!smooth) mesh = unshared(mesh);
  std::vector<Vector> normals = meanNormals(mesh), tangents = meanTangents(mesh);
  replaceByThoseThere(normals, mesh.normals);
  replaceByThoseThere(tangents, mesh.tangents);
  Surface surface;
  for (size_t i = 0; i < normals.size(); ++i) {
    const Vector n = normals[i].stableNormalized(), t = tangents[i] - tangents[i].dot(n) * n;
    const Vector roundTheAxis(-n.y(), n.x(), 0);
    surface.normals.push_back(assume<Direction>(n));
    surface.tangents.push_back(assume<Direction>(t.norm() > 0 ? t.stableNormalized() : roundTheAxis));
  }
  surface.textureCoordinates = std::move(mesh.textureCoordinates);
  surface.mesh = std::move(mesh.mesh);
  return {std::move(surface), hash};
}

namespace {

constexpr int kMostBoxSegments = 512, kMostCopies = 100'000;
constexpr size_t kMostPoints = 10'000;

// Context for reading shapes.
struct Making {
  int segments;                  // default for shapes without their own
  std::vector<uint64_t>& hashes; // of the files that were read
};

struct ShapeKind {
  std::string_view type;
  scene::Keys keys;
  Surface (*read)(const scene::Section&, const Making&);
};

Surface asShape(const scene::Entry& entry, const Making& making);

int segmentsOr(const scene::Section& s, const Making& making) {
  return integerOr(s, "segments", kFewestSegments, kMostSegments, making.segments);
}

bool booleanOr(const scene::Section& s, std::string_view key, bool otherwise) {
  const auto entry = s.find(key);
  return entry ? scene::asBoolean(*entry) : otherwise;
}

double numberOr(const scene::Section& s, std::string_view key, double least, double most, double otherwise) {
  const auto entry = s.find(key);
  return entry ? numberIn(*entry, least, most) : otherwise;
}

// A number, or nothing if the value is of another type.
std::optional<double> numberIfAny(const scene::Entry& entry) {
  try {
    return scene::asNumber(entry);
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::vector<scene::Entry> asPoints(const scene::Entry& entry, std::string_view form) {
  std::vector<scene::Entry> points = scene::asArray(entry, form);
  if (points.size() > kMostPoints)
    throw scene::mismatch(entry, fmt::format("at most {} points", kMostPoints));
  return points;
}

std::vector<ProfilePoint> asProfile(const scene::Entry& entry) {
  constexpr std::string_view form = "points [radius, height]";
  std::vector<ProfilePoint> profile;
  bool isWide = false;
  for (const scene::Entry& point : asPoints(entry, form)) {
    const auto parts = scene::asArray(point, form);
    if (parts.size() != 2) throw scene::mismatch(point, form);
    profile.push_back({numberIn(parts[0], 0, 1e9), numberIn(parts[1], -1e9, 1e9)});
    isWide = isWide || profile.back().radius > 0;
  }
  if (!isWide) throw scene::mismatch(entry, "a point off the axis");
  return profile;
}

// Curve from `points` [x, y, z] and `radius`: one for all, or one per point.
std::vector<CurvePoint> asCurve(const scene::Section& s) {
  const scene::Entry list = s.require("points"), radius = s.require("radius");
  std::vector<CurvePoint> points;
  for (const scene::Entry& point : asPoints(list, "a list of points")) points.push_back({asVector(point)});
  if (const auto one = numberIfAny(radius)) {
    for (CurvePoint& p : points) p.radius = *one;
  } else {
    const auto each = scene::asArray(radius, "a number, or one for each point");
    if (each.size() != points.size()) throw scene::mismatch(radius, "as many as there are points");
    for (size_t i = 0; i < points.size(); ++i) points[i].radius = numberIn(each[i], 0, 1e9);
  }
  const double thickest = points.empty() ? 1 : std::ranges::max(points, {}, &CurvePoint::radius).radius;
  if (!(thickest >= 1e-9 && thickest <= 1e9)) throw scene::mismatch(radius, "a radius above 0, in 1e-9..1e9");
  return points;
}

// Reports an impossible curve at its `points`.
template <class Make> Surface alongCurve(const scene::Section& s, Make make) {
  const std::vector<CurvePoint> points = asCurve(s);
  const bool closed = booleanOr(s, "closed", false);
  return scene::at(s.require("points"), [&] { return make(points, closed); });
}

const std::vector<ShapeKind>& shapeKinds() {
  static const std::vector<ShapeKind> kinds = {
      {"sphere",
       {"center", "radius", "segments"},
       [](const scene::Section& s, const Making& making) {
         return sphere(pointOr0(s, "center"), positive(s.require("radius")), segmentsOr(s, making));
       }},
      {"bumpy_sphere",
       {"center", "radius", "segments", "amplitude", "frequency"},
       [](const scene::Section& s, const Making& making) {
         return bumpySphere(pointOr0(s, "center"), positive(s.require("radius")),
                            numberIn(s.require("amplitude"), 0, 0.9),
                            numberIn(s.require("frequency"), 0, 1000), segmentsOr(s, making));
       }},
      {"cylinder",
       {"center", "radius", "height", "segments"},
       [](const scene::Section& s, const Making& making) {
         return cylinder(pointOr0(s, "center"), positive(s.require("radius")), positive(s.require("height")),
                         segmentsOr(s, making));
       }},
      {"box",
       {"center", "size", "segments"},
       [](const scene::Section& s, const Making&) {
         const scene::Entry size = s.require("size");
         const Vec3<double> sides = asVector(size);
         if (!(sides.minCoeff() >= 1e-9)) throw scene::mismatch(size, "three lengths above 0");
         return box(pointOr0(s, "center"), sides, integerOr(s, "segments", 1, kMostBoxSegments, 32));
       }},
      {"lathe",
       {"profile", "closed", "segments"},
       [](const scene::Section& s, const Making& making) {
         const scene::Entry entry = s.require("profile");
         const std::vector<ProfilePoint> profile = asProfile(entry);
         const bool closed = booleanOr(s, "closed", true);
         const int segments = segmentsOr(s, making);
         return scene::at(entry, [&] { return lathe(profile, closed, segments); });
       }},
      {"tube",
       {"points", "radius", "closed", "segments"},
       [](const scene::Section& s, const Making& making) {
         const int segments = segmentsOr(s, making);
         return alongCurve(s,
                           [&](const auto& points, bool closed) { return tube(points, closed, segments); });
       }},
      {"braid",
       {"points", "radius", "closed", "turns", "fibres", "seed"},
       [](const scene::Section& s, const Making&) {
         const BraidShape shape{scene::asInteger(s.require("turns"), 1, 10'000),
                                integerOr(s, "fibres", 8, 1000, 24),
                                static_cast<uint64_t>(integerOr(s, "seed", 0, 1 << 30, 1))};
         return alongCurve(s, [&](const auto& points, bool closed) { return braid(points, closed, shape); });
       }},
      {"fur",
       {"on", "hairs", "length", "radius", "comb", "disorder", "seed"},
       [](const scene::Section& s, const Making& making) {
         const auto comb = s.find("comb");
         const scene::Entry hairs = s.require("hairs");
         FurShape shape{scene::asInteger(hairs, 1, 1'000'000), positive(s.require("length")),
                        positive(s.require("radius"))};
         if (comb) shape.comb = asVector(*comb);
         shape.disorder = numberOr(s, "disorder", 0, 1, 0);
         shape.seed = static_cast<uint64_t>(integerOr(s, "seed", 0, 1 << 30, 1));
         const Surface skin = asShape(s.require("on"), making);
         return scene::at(hairs, [&] { return fur(skin, shape); });
       }},
      {"mesh", {"file", "smooth"}, [](const scene::Section& s, const Making& making) {
         const scene::Entry path = s.require("file");
         const bool smooth = booleanOr(s, "smooth", true);
         SurfaceFile file = scene::atFile(path, [&] { return readSurface(scene::asPath(path), smooth); });
         making.hashes.push_back(file.hash);
         return std::move(file.surface);
       }}};
  return kinds;
}

// ---- What every shape can have done to it ----

const scene::Keys kChangeKeys = {"displace", "planar_texture", "fibre_deg"},
                  kPlaceKeys = {"position", "rotate_axis", "rotate_deg", "scale"};

// Twice the area of a mesh.
double sizeOf(const TriangleMesh& mesh) {
  double sum = 0;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) sum += areaVector(mesh, i).norm();
  return sum;
}

Surface changed(const scene::Section& s, Surface surface) {
  if (const auto formula = s.find("displace")) {
    const double before = sizeOf(surface.mesh);
    surface = scene::at(*formula, [&] {
      return displaced(surface, warp::Expression(scene::asText(*formula), kHeightVariables));
    });
    // A collapsed surface keeps some area by rounding.
    if (sizeOf(surface.mesh) < 1e-6 * before)
      throw scene::mismatch(*formula, "heights that leave a millionth of the area or more");
  }
  if (booleanOr(s, "planar_texture", false)) surface = withPlanarTexture(surface);
  if (const auto turn = s.find("fibre_deg"))
    surface = withTangentsTurned(surface, Angle::fromDegrees(numberIn(*turn, -360, 360)));
  return surface;
}

// One scale for all axes, or one per axis; negative mirrors.
Vec3<double> asScale(const scene::Entry& entry) {
  const auto one = numberIfAny(entry);
  const Vec3<double> scale = one ? Vec3<double>::Constant(*one) : asVector(entry);
  if (!(scale.cwiseAbs().minCoeff() >= 1e-6 && scale.cwiseAbs().maxCoeff() <= 1e6))
    throw scene::mismatch(entry, "factors of 1e-6..1e6, or below 0 to mirror");
  return scale;
}

// Surface scaled, then rotated, then moved.
Surface placed(const scene::Section& s, const Surface& surface) {
  const auto axisEntry = s.find("rotate_axis"), angle = s.find("rotate_deg"), scaleEntry = s.find("scale"),
             position = s.find("position");
  if (!angle && !scaleEntry && !position)
    return axisEntry ? throw scene::mismatch(*axisEntry, "rotate_deg beside it") : surface;
  const Vec3<double> axis = axisEntry ? asVector(*axisEntry) : Vec3<double>(0, 0, 1);
  if (!(axis.norm() > 1e-9)) throw scene::mismatch(*axisEntry, "a direction");
  const double radians = angle ? Angle::fromDegrees(numberIn(*angle, -360, 360)).radians() : 0;
  const Vec3<double> scale = scaleEntry ? asScale(*scaleEntry) : Vec3<double>(1, 1, 1);
  const Mat3<double> linear =
      Eigen::AngleAxisd(radians, axis.normalized()).toRotationMatrix() * scale.asDiagonal();
  return transformed(surface, linear, position ? asVector(*position) : Vec3<double>(0, 0, 0));
}

Surface copied(const scene::Section& s, Surface surface) {
  const auto requireRoom = [&](const scene::Entry& entry, size_t copies) {
    scene::at(entry, [&] { requireFewTriangles(copies * surface.mesh.triangles.size()); });
  };
  if (const auto copies = s.find("copies")) {
    const std::vector<scene::Entry> places = scene::asArray(*copies, "a list of places");
    if (places.empty()) throw scene::mismatch(*copies, "one copy or more");
    requireRoom(*copies, places.size());
    const Surface one = std::move(surface);
    surface = {};
    for (const scene::Entry& place : places) append(surface, placed(scene::Section(place, kPlaceKeys), one));
  }
  if (const auto ring = s.find("ring")) {
    const int count = scene::asInteger(*ring, 1, kMostCopies);
    requireRoom(*ring, static_cast<size_t>(count));
    const Surface one = std::move(surface);
    surface = {};
    for (int i = 0; i < count; ++i) {
      const Eigen::AngleAxisd turn(2 * std::numbers::pi * i / count, Vec3<double>::UnitZ());
      append(surface, transformed(one, turn.toRotationMatrix(), Vec3<double>::Zero()));
    }
  }
  return surface;
}

const ShapeKind& kindOf(const scene::Entry& entry) {
  scene::Keys types;
  for (const ShapeKind& kind : shapeKinds()) types.push_back(kind.type);
  return shapeKinds()[scene::typeOf(entry, types)];
}

// Section with all keys of a shape's table, and more.
scene::Section shapeSection(const scene::Entry& entry, const scene::Keys& more) {
  scene::Keys known = kindOf(entry).keys;
  known.insert(known.end(), {"type", "copies", "ring"});
  for (const scene::Keys& keys : {kChangeKeys, kPlaceKeys, more})
    known.insert(known.end(), keys.begin(), keys.end());
  return {entry, known};
}

Surface made(const scene::Section& section, const ShapeKind& kind, const Making& making) {
  return copied(section, placed(section, changed(section, kind.read(section, making))));
}

Surface asShape(const scene::Entry& entry, const Making& making) {
  Surface surface = made(shapeSection(entry, {}), kindOf(entry), making);
  scene::at(entry, [&] { requireVisible(surface); });
  return surface;
}

StageObject asObject(const scene::Entry& entry, const MaterialList& materials, const Making& making) {
  const scene::Section section = shapeSection(entry, {"material"});
  const scene::Entry name = section.require("material");
  const auto& [material, textures] = materials.named(name);
  StageObject object{made(section, kindOf(entry), making), material, textures};
  scene::at(entry, [&] { requireVisible(object.surface); });
  if (textures.any() && object.surface.textureCoordinates.empty())
    throw scene::mismatch(name,
                          "a material without texture: the mesh of this file has no texture coordinates");
  return object;
}

} // namespace

ObjectList asObjects(const scene::Entry& entry, const MaterialList& materials, int segments) {
  ObjectList list;
  size_t triangles = 0;
  for (const scene::Entry& table : scene::asArray(entry, "tables under [[object]]")) {
    list.objects.push_back(asObject(table, materials, {segments, list.hashes}));
    triangles += list.objects.back().surface.mesh.triangles.size();
    scene::at(table, [&] { requireFewTriangles(triangles); });
  }
  if (list.objects.empty()) throw scene::mismatch(entry, "one object or more");
  return list;
}

} // namespace surflect::stage
