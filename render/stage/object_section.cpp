#include "render/stage/object_section.h"

#include "render/stage/stage_fields.h"

#include <fmt/format.h>

namespace surflect {

namespace {

constexpr int kMostSegments = 2048, kMostBoxSegments = 512;
constexpr size_t kMostTriangles = size_t{1} << 25; // in all

struct ShapeKind {
  std::string_view type;
  Keys keys;
  Surface (*read)(const Section&);
};

int segmentsOr(const Section& s) { return integerOr(s, "segments", 3, kMostSegments, 256); }

const std::vector<ShapeKind>& shapeKinds() {
  static const std::vector<ShapeKind> kinds = {
      {"sphere",
       {"center", "radius", "segments"},
       [](const Section& s) {
         return sphere(pointOr0(s, "center"), positive(s.require("radius")), segmentsOr(s));
       }},
      {"bumpy_sphere",
       {"center", "radius", "segments", "amplitude", "frequency"},
       [](const Section& s) {
         return bumpySphere(pointOr0(s, "center"), positive(s.require("radius")),
                            numberIn(s.require("amplitude"), 0, 0.9),
                            numberIn(s.require("frequency"), 0, 1000), segmentsOr(s));
       }},
      {"cylinder",
       {"center", "radius", "height", "segments"},
       [](const Section& s) {
         return cylinder(pointOr0(s, "center"), positive(s.require("radius")), positive(s.require("height")),
                         segmentsOr(s));
       }},
      {"box",
       {"center", "size", "segments"},
       [](const Section& s) {
         const Entry size = s.require("size");
         const Vec3<double> sides = asVector(size);
         if (!(sides.minCoeff() >= 1e-9)) throw mismatch(size, "three lengths above 0");
         return box(pointOr0(s, "center"), sides, integerOr(s, "segments", 1, kMostBoxSegments, 32));
       }},
      {"mesh", {"file", "smooth"}, [](const Section& s) {
         const auto smooth = s.find("smooth");
         return readSurface(asPath(s.require("file")), smooth ? asBoolean(*smooth) : true);
       }}};
  return kinds;
}

StageObject asObject(const Entry& entry, const MaterialList& materials,
                     std::vector<std::filesystem::path>& files) {
  Keys types;
  for (const ShapeKind& kind : shapeKinds()) types.push_back(kind.type);
  const ShapeKind& kind = shapeKinds()[typeOf(entry, types)];
  Keys known = kind.keys;
  known.insert(known.end(), {"type", "material"});
  const Section section(entry, known);
  const Entry name = section.require("material");
  const auto& [material, texture] = materials.named(name);
  if (const auto file = section.find("file")) files.push_back(asPath(*file));
  StageObject object{kind.read(section), material, texture};
  if (texture && object.surface.textureCoordinates.empty())
    throw mismatch(name, "a material without texture: meshes of files have no texture coordinates here");
  return object;
}

} // namespace

ObjectList asObjects(const Entry& entry, const MaterialList& materials) {
  ObjectList list;
  size_t triangles = 0;
  for (const Entry& table : asArray(entry, "tables under [[object]]")) {
    list.objects.push_back(asObject(table, materials, list.files));
    triangles += list.objects.back().surface.mesh.triangles.size();
    if (triangles > kMostTriangles)
      throw Error::mismatch(fmt::format("at most {} triangles in all", kMostTriangles), "more")
          .at(table.field);
  }
  if (list.objects.empty()) throw mismatch(entry, "one object or more");
  return list;
}

} // namespace surflect
