#include "warp/gltf.h"

#include "surfel/base/error.h"
#include "warp/gltf_document.h"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

namespace surflect::warp {

namespace {

// Returns for each node whether its motion moves the skin: joints and their ancestors.
std::vector<uint8_t> movesSkin(const Skeleton& skeleton) {
  std::vector<uint8_t> moves(skeleton.nodes.size(), 0);
  for (const SkinJoint& joint : skeleton.joints) moves[joint.node] = 1;
  for (size_t k = skeleton.order.size(); k-- > 0;)
    if (const uint32_t i = skeleton.order[k]; moves[i] && skeleton.nodes[i].parent)
      moves[*skeleton.nodes[i].parent] = 1;
  return moves;
}

// Effect of an animation channel on the skin; empty if it has none.
std::optional<Channel> readChannel(GltfDocument& document, const GltfField& field,
                                   const std::vector<GltfField>& samplers, const Skeleton& skeleton,
                                   const std::vector<GltfField>& nodes, const std::vector<uint8_t>& moves) {
  Channel channel;
  const GltfField target = field.require("target"), path = target.require("path");
  const auto node = target.find("node");
  if (!node) return std::nullopt; // defined by an extension
  channel.node = static_cast<uint32_t>(node->index(skeleton.nodes.size()));
  if (path.text() == "weights") {
    if (nodes[channel.node].find("skin"))
      path.refuse("none that morphs the skin: morph targets are not read");
    return std::nullopt;
  }
  if (!moves[channel.node]) return std::nullopt;
  if (skeleton.nodes[channel.node].fixed) node->refuse("a node without a matrix");
  if (path.text() == "translation")
    channel.property = Channel::Property::translation;
  else if (path.text() == "rotation")
    channel.property = Channel::Property::rotation;
  else if (path.text() == "scale")
    channel.property = Channel::Property::scale;
  else
    path.refuse("translation, rotation or scale");

  const GltfField sampler = samplers[field.require("sampler").index(samplers.size())];
  const auto interpolation = sampler.find("interpolation");
  const std::string name = interpolation ? interpolation->text() : "LINEAR";
  if (name == "STEP")
    channel.interpolation = Interpolation::step;
  else if (name == "LINEAR")
    channel.interpolation = Interpolation::linear;
  else if (name == "CUBICSPLINE")
    channel.interpolation = Interpolation::cubicSpline;
  else
    interpolation->refuse("LINEAR, STEP or CUBICSPLINE");

  const GltfField input = sampler.require("input"), output = sampler.require("output");
  channel.seconds = document.read(input, "SCALAR", 1, GltfNumbers::floats);
  for (size_t i = 1; i < channel.seconds.size(); ++i)
    if (!(channel.seconds[i] > channel.seconds[i - 1])) input.refuse("times that increase");
  const bool turns = channel.property == Channel::Property::rotation;
  const size_t width = turns ? 4 : 3;
  channel.values = document.read(output, turns ? "VEC4" : "VEC3", width,
                                 turns ? GltfNumbers::floatsOrNormalized : GltfNumbers::floats);
  const size_t perKey = channel.interpolation == Interpolation::cubicSpline ? 3 * width : width;
  if (channel.values.size() != perKey * channel.seconds.size())
    output.refuse("values for " + std::to_string(channel.seconds.size()) + " keys");
  if (turns)
    for (size_t i = perKey == width ? 0 : width; i < channel.values.size(); i += perKey) {
      Eigen::Map<Eigen::Vector4d> key(&channel.values[i]);
      if (!(key.norm() > 1e-6)) output.refuse("rotations");
      key.normalize();
    }
  return channel;
}

} // namespace

std::vector<GltfAnimation> readAnimations(GltfDocument& document, const Skeleton& skeleton) {
  std::vector<GltfAnimation> animations;
  const std::vector<GltfField> nodes = document.root().elementsOf("nodes");
  const std::vector<uint8_t> moves = movesSkin(skeleton);
  for (const GltfField& field : document.root().elementsOf("animations")) {
    GltfAnimation& animation = animations.emplace_back();
    try {
      if (const auto name = field.find("name")) animation.name = name->text();
      const std::vector<GltfField> samplers = field.require("samplers").elements();
      for (const GltfField& channel : field.require("channels").elements())
        if (auto read = readChannel(document, channel, samplers, skeleton, nodes, moves))
          animation.channels.push_back(std::move(*read));
    } catch (Error& error) {
      animation.channels.clear();
      animation.refusal = std::move(error);
    }
  }
  return animations;
}

namespace {

// Limit of joints: nodes may share a skin, so a small file may have any number.
constexpr size_t mostJoints = size_t{1} << 20;

// Prefixes of extensions that change neither shape, motion nor texture coordinates.
constexpr std::array<std::string_view, 7> kPassedOverByMeshes = {
    "KHR_materials_", "KHR_lights_", "KHR_xmp",      "KHR_texture_basisu",
    "EXT_texture_",   "EXT_lights_", "MSFT_texture_"};
// Extensions ignored for skins: those above, and the one for texture coordinates.
constexpr std::array<std::string_view, 8> kPassedOverBySkins = {
    "KHR_materials_", "KHR_lights_", "KHR_xmp",       "KHR_texture_basisu",
    "EXT_texture_",   "EXT_lights_", "MSFT_texture_", "KHR_texture_transform"};

// ---- Nodes ----

// Matrix of 16 numbers, column by column, whose last row is 0 0 0 1.
AffineMap asAffine(const double* m) {
  AffineMap map;
  map.linear << m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10];
  map.offset << m[12], m[13], m[14];
  return map;
}

SkeletonNode readNode(const GltfField& field) {
  SkeletonNode node;
  if (const auto matrix = field.find("matrix")) {
    const Eigen::VectorXd m = matrix->numbers(16);
    node.fixed = asAffine(m.data());
  }
  if (const auto translation = field.find("translation")) node.translation = translation->numbers(3);
  if (const auto scale = field.find("scale")) node.scale = scale->numbers(3);
  if (const auto rotation = field.find("rotation")) {
    node.rotation.coeffs() = rotation->numbers(4);
    if (!(node.rotation.norm() > 1e-6)) rotation->refuse("a rotation");
    node.rotation.normalize();
  }
  return node;
}

void readNodes(const std::vector<GltfField>& fields, Skeleton& skeleton) {
  for (const GltfField& field : fields) skeleton.nodes.push_back(readNode(field));
  const size_t count = fields.size();
  std::vector<std::vector<uint32_t>> children(count);
  for (size_t i = 0; i < count; ++i)
    for (const GltfField& child : fields[i].elementsOf("children")) {
      const size_t index = child.index(count);
      if (skeleton.nodes[index].parent) child.refuse("a node that is nobody's child");
      skeleton.nodes[index].parent = static_cast<uint32_t>(i);
      children[i].push_back(static_cast<uint32_t>(index));
    }
  for (uint32_t i = 0; i < count; ++i)
    if (!skeleton.nodes[i].parent) skeleton.order.push_back(i);
  for (size_t k = 0; k < skeleton.order.size(); ++k)
    skeleton.order.insert(skeleton.order.end(), children[skeleton.order[k]].begin(),
                          children[skeleton.order[k]].end());
  if (skeleton.order.size() != count) throw Error("are their own ancestors").at("nodes");
}

// ---- Skins ----

// Appends the joints of a skin and returns their number.
size_t readSkin(GltfDocument& document, const GltfField& skin, Skeleton& skeleton) {
  const std::vector<GltfField> joints = skin.require("joints").elements();
  if (skeleton.joints.size() + joints.size() > mostJoints)
    throw Error::mismatch("at most " + std::to_string(mostJoints) + " joints in all", "more").at(skin.path());
  std::vector<double> inverseBind;
  if (const auto field = skin.find("inverseBindMatrices")) {
    inverseBind = document.read(*field, "MAT4", 16, GltfNumbers::floats);
    if (inverseBind.size() < 16 * joints.size())
      field->refuse("matrices for " + std::to_string(joints.size()) + " joints");
  }
  for (size_t i = 0; i < joints.size(); ++i) {
    SkinJoint joint;
    joint.node = static_cast<uint32_t>(joints[i].index(skeleton.nodes.size()));
    if (!inverseBind.empty()) joint.inverseBind = asAffine(&inverseBind[16 * i]);
    skeleton.joints.push_back(joint);
  }
  return joints.size();
}

// Reads up to 4 joints per vertex from each pair of attributes JOINTS_n, WEIGHTS_n; normalises the weights to
// sum 1.
void readInfluences(GltfDocument& document, const GltfField& attributes, size_t vertices, size_t firstJoint,
                    size_t joints, Skeleton& skeleton) {
  std::vector<std::vector<double>> indices, weights;
  for (int set = 0;; ++set) {
    const auto j = attributes.find("JOINTS_" + std::to_string(set)),
               w = attributes.find("WEIGHTS_" + std::to_string(set));
    if (!j && !w && set > 0) break;
    if (!j || !w) throw Error("has no JOINTS_n and WEIGHTS_n of equal n").at(attributes.path());
    indices.push_back(document.read(*j, "VEC4", 4, GltfNumbers::integers));
    weights.push_back(document.read(*w, "VEC4", 4, GltfNumbers::floatsOrNormalized));
    if (indices.back().size() != 4 * vertices)
      j->refuse(std::to_string(vertices) + " elements, as positions");
    if (weights.back().size() != 4 * vertices)
      w->refuse(std::to_string(vertices) + " elements, as positions");
  }
  for (size_t v = 0; v < vertices; ++v) {
    const std::string place = "vertex " + std::to_string(v);
    double sum = 0;
    for (const auto& set : weights)
      for (size_t k = 4 * v; k < 4 * v + 4; ++k) {
        if (set[k] < 0) throw Error::mismatch("none below 0", "a weight of " + place).at(attributes.path());
        sum += set[k];
      }
    if (!(sum > 1e-6))
      throw Error::mismatch("at least one weight above 0", "none at " + place).at(attributes.path());
    skeleton.firstInfluence.push_back(static_cast<uint32_t>(skeleton.influences.size()));
    for (size_t s = 0; s < weights.size(); ++s)
      for (size_t k = 4 * v; k < 4 * v + 4; ++k) {
        if (weights[s][k] == 0) continue;
        if (!(indices[s][k] < static_cast<double>(joints)))
          throw Error::mismatch("a joint below " + std::to_string(joints),
                                std::to_string(static_cast<uint64_t>(indices[s][k])) + " at " + place)
              .at(attributes.path());
        skeleton.influences.push_back(
            {static_cast<uint32_t>(firstJoint + static_cast<size_t>(indices[s][k])), weights[s][k] / sum});
      }
  }
}

std::vector<Vec3<double>> readVectors(GltfDocument& document, const GltfField& reference) {
  const std::vector<double> numbers = document.read(reference, "VEC3", 3, GltfNumbers::floats);
  std::vector<Vec3<double>> vectors;
  for (size_t i = 0; i < numbers.size(); i += 3)
    vectors.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return vectors;
}

// Throws for morph targets with a weight. Weights are 0 unless the node, or else the mesh, states them.
// [glTF, §3.7.2.2]
void requireNoMorphing(const GltfField& node, const GltfField& mesh) {
  auto weights = node.find("weights");
  if (!weights) weights = mesh.find("weights");
  if (!weights) return;
  for (const GltfField& primitive : mesh.require("primitives").elements())
    if (primitive.find("targets"))
      for (const GltfField& weight : weights->elements())
        if (weight.number() != 0) weight.refuse("0: morph targets are not read");
}

// Positions of a primitive, which must consist of triangles.
std::vector<Vec3<double>> readPositions(GltfDocument& document, const GltfField& primitive) {
  if (const auto mode = primitive.find("mode"); mode && mode->integer(6) != 4) mode->refuse("4, triangles");
  return readVectors(document, primitive.require("attributes").require("POSITION"));
}

// Appends the triangles of a primitive, whose `count` vertices begin at `first`.
void readTriangles(GltfDocument& document, const GltfField& primitive, size_t first, size_t count,
                   std::vector<std::array<uint32_t, 3>>& triangles) {
  std::vector<double> corners;
  if (const auto indices = primitive.find("indices")) {
    corners = document.read(*indices, "SCALAR", 1, GltfNumbers::integers);
    if (std::ranges::any_of(corners, [&](double c) { return c >= static_cast<double>(count); }))
      indices->refuse("vertices below " + std::to_string(count));
  } else {
    for (size_t i = 0; i < count; ++i) corners.push_back(static_cast<double>(i));
  }
  if (corners.size() % 3 != 0) throw Error("the last triangle is not whole").at(primitive.path());
  const auto vertex = [&](size_t i) {
    return static_cast<uint32_t>(first + static_cast<size_t>(corners[i]));
  };
  for (size_t i = 0; i < corners.size(); i += 3)
    triangles.push_back({vertex(i), vertex(i + 1), vertex(i + 2)});
}

void readPrimitive(GltfDocument& document, const GltfField& primitive, size_t firstJoint, size_t joints,
                   Skeleton& skeleton) {
  const std::vector<Vec3<double>> positions = readPositions(document, primitive);
  const size_t first = skeleton.vertices.size(), count = positions.size();
  skeleton.vertices.insert(skeleton.vertices.end(), positions.begin(), positions.end());
  readInfluences(document, primitive.require("attributes"), count, firstJoint, joints, skeleton);
  readTriangles(document, primitive, first, count, skeleton.triangles);
}

Skeleton readSkeleton(GltfDocument& document) {
  Skeleton skeleton;
  const std::vector<GltfField> nodes = document.root().elementsOf("nodes"),
                               meshes = document.root().elementsOf("meshes"),
                               skins = document.root().elementsOf("skins");
  readNodes(nodes, skeleton);
  for (const GltfField& node : nodes) {
    const auto mesh = node.find("mesh"), skin = node.find("skin");
    if (!mesh || !skin) continue;
    const size_t firstJoint = skeleton.joints.size();
    const size_t joints = readSkin(document, skins[skin->index(skins.size())], skeleton);
    const GltfField& ofNode = meshes[mesh->index(meshes.size())];
    requireNoMorphing(node, ofNode);
    for (const GltfField& primitive : ofNode.require("primitives").elements())
      readPrimitive(document, primitive, firstJoint, joints, skeleton);
  }
  if (skeleton.vertices.empty()) throw Error::mismatch("a node with a mesh and a skin", "none").at("nodes");
  skeleton.firstInfluence.push_back(static_cast<uint32_t>(skeleton.influences.size()));
  return skeleton;
}

// ---- Meshes at rest ----

// Fills up an attribute that only some primitives have, with 0 for the vertices of others.
template <class Vector> void fillUp(std::vector<Vector>& vectors, size_t count) {
  vectors.resize(count, Vector::Zero());
}

void appendPrimitive(GltfDocument& document, const GltfField& primitive, const AffineMap& worldFromNode,
                     TexturedMesh& mesh) {
  const std::vector<Vec3<double>> positions = readPositions(document, primitive);
  const GltfField attributes = primitive.require("attributes");
  const size_t first = mesh.mesh.positions.size(), count = positions.size();
  for (const auto& p : positions) {
    mesh.mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(worldFromNode(p)));
    if (!mesh.mesh.positions.back().raw().allFinite())
      throw Error::mismatch("positions within single precision", "one beyond it").at(attributes.path());
  }
  // Normals transform by det(A) A^-T, which exists also for singular A.
  const Mat3<double>& a = worldFromNode.linear;
  const bool mirrors = a.determinant() < 0;
  const auto normals = attributes.find("NORMAL");
  if (normals) {
    fillUp(mesh.normals, first);
    Mat3<double> cofactors;
    cofactors << a.col(1).cross(a.col(2)), a.col(2).cross(a.col(0)), a.col(0).cross(a.col(1));
    for (const auto& n : readVectors(document, *normals))
      mesh.normals.push_back((mirrors ? -1. : 1.) * (cofactors * n));
    if (mesh.normals.size() != first + count)
      normals->refuse(std::to_string(count) + " elements, as positions");
  }
  // [glTF, §3.7.2.1]: without normals, tangents are to be ignored
  if (const auto field = attributes.find("TANGENT"); field && normals) {
    fillUp(mesh.tangents, first);
    // w is the sign of the bitangent
    const std::vector<double> xyzw = document.read(*field, "VEC4", 4, GltfNumbers::floats);
    for (size_t i = 0; i < xyzw.size(); i += 4)
      mesh.tangents.push_back(a * Vec3<double>(xyzw[i], xyzw[i + 1], xyzw[i + 2]));
    if (mesh.tangents.size() != first + count)
      field->refuse(std::to_string(count) + " elements, as positions");
  }
  if (const auto field = attributes.find("TEXCOORD_0")) {
    fillUp(mesh.textureCoordinates, first);
    const std::vector<double> st = document.read(*field, "VEC2", 2, GltfNumbers::floatsOrNormalized);
    // [glTF, §3.8.1]: the origin is the upper left corner
    for (size_t i = 0; i < st.size(); i += 2) mesh.textureCoordinates.emplace_back(st[i], 1 - st[i + 1]);
    if (mesh.textureCoordinates.size() != first + count)
      field->refuse(std::to_string(count) + " elements, as positions");
  }
  const size_t firstTriangle = mesh.mesh.triangles.size();
  readTriangles(document, primitive, first, count, mesh.mesh.triangles);
  for (size_t i = firstTriangle; mirrors && i < mesh.mesh.triangles.size(); ++i)
    std::swap(mesh.mesh.triangles[i][1], mesh.mesh.triangles[i][2]);
}

TexturedMesh readMeshes(GltfDocument& document) {
  const std::vector<GltfField> nodes = document.root().elementsOf("nodes"),
                               meshes = document.root().elementsOf("meshes");
  Skeleton skeleton;
  readNodes(nodes, skeleton);
  const std::vector<AffineMap> global = globalsOf(skeleton.nodes, skeleton.order);
  TexturedMesh textured;
  for (size_t i = 0; i < nodes.size(); ++i) {
    const auto mesh = nodes[i].find("mesh");
    if (!mesh) continue;
    const AffineMap map = nodes[i].find("skin") ? AffineMap() : global[i];
    const GltfField& ofNode = meshes[mesh->index(meshes.size())];
    requireNoMorphing(nodes[i], ofNode);
    for (const GltfField& primitive : ofNode.require("primitives").elements())
      appendPrimitive(document, primitive, map, textured);
  }
  if (textured.mesh.triangles.empty()) throw Error::mismatch("a node with a mesh", "none").at("nodes");
  const size_t vertices = textured.mesh.positions.size();
  if (!textured.normals.empty()) fillUp(textured.normals, vertices);
  if (!textured.tangents.empty()) fillUp(textured.tangents, vertices);
  if (!textured.textureCoordinates.empty()) fillUp(textured.textureCoordinates, vertices);
  for (size_t i = 0; i < textured.mesh.positions.size(); ++i)
    textured.corner.push_back(static_cast<uint32_t>(i));
  return textured;
}

// Runs read(document), whose Errors get the file's name.
template <class Read>
auto ofFile(const std::filesystem::path& path, std::span<const std::string_view> passedOver, Read read) {
  try {
    GltfDocument document(path, passedOver);
    return read(document);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace

GltfFile readGltf(const std::filesystem::path& path) {
  return ofFile(path, kPassedOverBySkins, [](GltfDocument& document) {
    GltfFile file;
    file.skeleton = readSkeleton(document);
    file.animations = readAnimations(document, file.skeleton);
    file.contentHash = document.contentHash();
    return file;
  });
}

GltfMesh readGltfMesh(const std::filesystem::path& path) {
  return ofFile(path, kPassedOverByMeshes, [](GltfDocument& document) {
    return GltfMesh{readMeshes(document), document.contentHash()};
  });
}

} // namespace surflect::warp
