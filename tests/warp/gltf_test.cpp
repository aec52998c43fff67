#include "warp/gltf.h"

#include "surfel/base/error.h"
#include "tests/srf/image/files.h"
#include "tests/warp/gltf_files.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

namespace surflect::warp {
namespace {

const image::TemporaryFolder& folder() {
  static const image::TemporaryFolder folder; // of this process: tests run side by side
  return folder;
}

GltfFile fileOf(const std::string& content, const std::string& name = "rig.glb") {
  const std::filesystem::path path = folder() / name;
  std::ofstream(path, std::ios::binary) << content;
  return readGltf(path);
}

// Without the file's name; of the file, or else of its first animation.
std::string complaintAbout(const std::string& content) {
  try {
    const GltfFile file = fileOf(content);
    if (!file.animations.empty() && file.animations[0].refusal)
      throw Error(*file.animations[0].refusal).in(folder() / "rig.glb");
  } catch (const Error& error) {
    EXPECT_TRUE(error.file().ends_with("rig.glb"));
    return error.what() + error.file().size() + 2;
  }
  return "no complaint";
}
std::string complaintAbout(const GltfMaker& maker) { return complaintAbout(maker.glb()); }

std::string base64(const std::string& bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t bits = 0;
    for (size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
    for (size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : digits[bits >> (18 - 6 * k) & 63];
  }
  return text;
}

TEST(Gltf, HoldsWhatTheFileSays) {
  const GltfFile file = fileOf(tubeFile(12, 8).glb());
  const Skeleton& skeleton = file.skeleton;
  EXPECT_EQ(skeleton.nodes.size(), 4u);
  EXPECT_EQ(skeleton.nodes[2].parent, 1u);
  EXPECT_EQ(skeleton.nodes[1].translation, Vec3<double>(0, 0, 1));
  ASSERT_EQ(skeleton.joints.size(), 3u);
  EXPECT_EQ(skeleton.joints[2].inverseBind.offset, Vec3<double>(0, 0, -2));
  EXPECT_EQ(skeleton.vertices.size(), 96u);
  EXPECT_EQ(skeleton.triangles.size(), 176u);
  ASSERT_EQ(skeleton.firstInfluence.size(), 97u);
  for (size_t i = 0; i < 96; ++i) {
    double sum = 0;
    for (uint32_t k = skeleton.firstInfluence[i]; k < skeleton.firstInfluence[i + 1]; ++k)
      sum += skeleton.influences[k].weight;
    EXPECT_NEAR(sum, 1, 1e-15);
  }
  ASSERT_EQ(file.animations.size(), 1u);
  EXPECT_EQ(file.animations[0].name, "Turn");
  EXPECT_EQ(file.animations[0].channels[1].node, 2u);
  EXPECT_EQ(file.animations[0].channels[1].seconds, (std::vector<double>{0, 2}));
}

TEST(Gltf, BuffersMayBeInTheFileOrBesideIt) {
  const GltfMaker maker = tubeFile();
  std::ofstream(folder() / "a buffer.bin", std::ios::binary) << maker.binary;
  const auto posed = [](const GltfFile& file) { return pose(file.skeleton, file.animations[0].channels, 1); };
  const auto expected = posed(fileOf(maker.glb()));
  for (const std::string& uri :
       {std::string("a%20buffer.bin"), "data:application/octet-stream;base64," + base64(maker.binary)})
    EXPECT_EQ(posed(fileOf(maker.json(uri), "rig.gltf")), expected);
}

TEST(Gltf, BuffersElsewhereAreRefused) {
  const GltfMaker maker = tubeFile();
  const image::TemporaryFolder elsewhere;
  const std::filesystem::path bytes = elsewhere / "bytes";
  std::ofstream(bytes, std::ios::binary) << maker.binary;
  std::filesystem::create_symlink(bytes, folder() / "link");
  for (const std::string& uri :
       {bytes.string(), "../" + elsewhere.path().filename().string() + "/bytes", std::string("link")})
    EXPECT_NE(complaintAbout(maker.json(uri)).find("expected a file in the folder"), std::string::npos)
        << uri;
}

TEST(Gltf, NumbersMayBeNormalizedAndApart) {
  GltfMaker plain = tubeFile(4, 3), packed = plain;
  std::vector<double> bytes, shares;
  for (int i = 0; i < 12; ++i)
    for (const double byte : {51. * (i % 3), 255. - 51 * (i % 3), 0., 0.}) {
      bytes.push_back(byte);
      shares.push_back(byte / 255);
    }
  auto& plainWeights = plain.document["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"];
  auto& packedWeights = packed.document["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"];
  plainWeights = plain.addFloats("VEC4", 4, shares);
  packedWeights = packed.add<uint8_t>("VEC4", 5121, 4, bytes, true, 12);
  // Signed 16 bit: -32768 is -1 too.
  auto& output = packed.document["animations"][0]["samplers"][0]["output"];
  output = packed.add<int16_t>("VEC4", 5122, 4, {0, 0, 0, 32767, -32768, 0, 0, 0}, true);
  auto& plainOutput = plain.document["animations"][0]["samplers"][0]["output"];
  plainOutput = plain.addFloats("VEC4", 4, {0, 0, 0, 1, -1, 0, 0, 0});

  const GltfFile a = fileOf(plain.glb()), b = fileOf(packed.glb());
  const auto p = pose(a.skeleton, a.animations[0].channels, 1.3),
             q = pose(b.skeleton, b.animations[0].channels, 1.3);
  for (size_t i = 0; i < p.size(); ++i) EXPECT_LT((p[i] - q[i]).norm(), 1e-6);
}

TEST(Gltf, ComplaintsNameTheField) {
  GltfMaker maker = tubeFile();
  const auto with = [&](const char* pointer, const nlohmann::json& value) {
    GltfMaker changed = maker;
    changed.document[nlohmann::json::json_pointer(pointer)] = value;
    return complaintAbout(changed);
  };
  EXPECT_EQ(complaintAbout(maker), "no complaint");
  EXPECT_EQ(with("/asset/version", "1.0"), "asset.version: found \"1.0\", expected 2.0");
  EXPECT_EQ(with("/skins/0/joints/2", 4), "skins[0].joints[2]: found 4, expected an integer in 0..3");
  EXPECT_EQ(with("/skins/0/joints/2", -1), "skins[0].joints[2]: found -1, expected an integer in 0..3");
  EXPECT_EQ(with("/nodes/3/skin", "x"), "nodes[3].skin: found \"x\", expected an integer in 0..0");
  EXPECT_EQ(with("/nodes/2/children", {0}), "nodes: are their own ancestors");
  EXPECT_EQ(with("/nodes/2/children", {1}),
            "nodes[2].children[0]: found 1, expected a node that is nobody's child");
  EXPECT_EQ(with("/meshes/0/primitives/0/mode", 5),
            "meshes[0].primitives[0].mode: found 5, expected 4, triangles");
  EXPECT_EQ(with("/accessors/0/count", 97), "accessors[0].count: found 97, expected an integer in 0..96");
  EXPECT_EQ(with("/accessors/0/count", 95),
            "meshes[0].primitives[0].attributes.JOINTS_0: found 1, expected 95 elements, as positions");
  EXPECT_EQ(with("/accessors/0/byteOffset", 4000000000u),
            "accessors[0].byteOffset: found 4000000000, expected an integer in 0..1152");
  EXPECT_EQ(with("/accessors/0/componentType", 5125),
            "accessors[0].componentType: found 5125, expected 5126, floating point");
  EXPECT_EQ(with("/bufferViews/0/byteStride", 4), "bufferViews[0].byteStride: found 4, expected at least 12");
  EXPECT_EQ(with("/animations/0/channels/0/target/path", "turn"),
            "animations[0].channels[0].target.path: found \"turn\", expected translation, rotation or scale");
  EXPECT_EQ(with("/animations/0/samplers/0/interpolation", "CUBICSPLINE"),
            "animations[0].samplers[0].output: found 6, expected values for 2 keys");
  EXPECT_EQ(with("/extensionsRequired", {"KHR_draco_mesh_compression"}),
            "extensionsRequired[0]: found \"KHR_draco_mesh_compression\", expected no required extension of "
            "shape or motion");
  maker.document["nodes"][3].erase("skin");
  EXPECT_EQ(complaintAbout(maker), "nodes: found none, expected a node with a mesh and a skin");
  EXPECT_EQ(complaintAbout("{"), "not glTF: no JSON object");
}

// A tube beside which a mesh without a skin, node 4, is morphed.
GltfMaker tubeWithFace() {
  GltfMaker maker = tubeFile(4, 3);
  auto& d = maker.document;
  nlohmann::json face = d["meshes"][0]["primitives"][0];
  face["attributes"].erase("JOINTS_0");
  face["attributes"].erase("WEIGHTS_0");
  face["targets"] = {{{"POSITION", face["attributes"]["POSITION"]}}};
  d["meshes"].push_back({{"primitives", {face}}, {"weights", {1}}});
  d["nodes"].push_back({{"mesh", 1}});
  return maker;
}

TEST(Gltf, WhatMovesOtherThingsThanTheSkinIsPassedOver) {
  GltfMaker maker = tubeWithFace();
  auto& channels = maker.document["animations"][0]["channels"];
  const auto posed = [&] {
    const GltfFile file = fileOf(maker.glb());
    EXPECT_FALSE(file.animations[0].refusal);
    EXPECT_EQ(file.animations[0].channels.size(), 2u);
    return pose(file.skeleton, file.animations[0].channels, 1.3);
  };
  const auto expected = posed();
  channels.push_back({{"sampler", 0}, {"target", {{"node", 4}, {"path", "weights"}}}});
  channels.push_back({{"sampler", 0}, {"target", {{"node", 4}, {"path", "scale"}}}}); // of what is not read
  maker.document["extensionsRequired"] = {"KHR_materials_unlit", "KHR_texture_transform"};
  EXPECT_EQ(posed(), expected);
}

TEST(Gltf, MorphingOfTheSkinIsRefusedWhereItDoesAnything) {
  GltfMaker maker = tubeWithFace();
  auto& d = maker.document;
  d["meshes"][0]["primitives"][0]["targets"] = d["meshes"][1]["primitives"][0]["targets"];
  EXPECT_EQ(complaintAbout(maker), "no complaint");
  d["meshes"][0]["weights"] = {0, 0.5};
  EXPECT_EQ(complaintAbout(maker), "meshes[0].weights[1]: found 0.5, expected 0: morph targets are not read");
  d["nodes"][3]["weights"] = {0, 0}; // comes before the mesh's
  EXPECT_EQ(complaintAbout(maker), "no complaint");
  d["animations"][0]["channels"].push_back({{"sampler", 0}, {"target", {{"node", 3}, {"path", "weights"}}}});
  EXPECT_EQ(complaintAbout(maker), "animations[0].channels[2].target.path: found \"weights\", expected none "
                                   "that morphs the skin: morph targets are not read");
}

TEST(Gltf, WeightsThatMakeNoSenseAreErrors) {
  const GltfMaker maker = tubeFile(4, 3);
  const auto with = [&](const char* name, const std::vector<double>& first4) {
    GltfMaker changed = maker;
    std::vector<double> numbers;
    for (int i = 0; i < 12; ++i) numbers.insert(numbers.end(), first4.begin(), first4.end());
    auto& attributes = changed.document["meshes"][0]["primitives"][0]["attributes"];
    attributes[name] = std::string(name) == "WEIGHTS_0" ? changed.addFloats("VEC4", 4, numbers)
                                                        : changed.add<uint8_t>("VEC4", 5121, 4, numbers);
    return complaintAbout(changed);
  };
  const std::string attributes = "meshes[0].primitives[0].attributes: ";
  EXPECT_EQ(with("WEIGHTS_0", {0, 0, 0, 0}),
            attributes + "found none at vertex 0, expected at least one weight above 0");
  EXPECT_EQ(with("WEIGHTS_0", {2, -1, 0, 0}),
            attributes + "found a weight of vertex 0, expected none below 0");
  EXPECT_EQ(with("WEIGHTS_0", {NAN, 1, 0, 0}).substr(0, 13), "accessors[8]:");
  EXPECT_EQ(with("JOINTS_0", {3, 1, 0, 0}), attributes + "found 3 at vertex 0, expected a joint below 3");
}

TEST(Gltf, EveryTruncationIsRejected) {
  const std::string whole = tubeFile(2, 3).glb();
  for (size_t length = 0; length < whole.size(); ++length)
    EXPECT_NE(complaintAbout(whole.substr(0, length)), "no complaint");
}

TEST(Gltf, EveryDamageGivesAFileOrAnErrorOfOneLine) {
  std::mt19937 random(1);
  const std::string whole = tubeFile(2, 3).glb();
  int files = 0;
  for (int i = 0; i < 4000; ++i) {
    std::string text = whole;
    for (int k = 0; k < 2; ++k)
      text[random() % text.size()] = static_cast<char>(i % 2 ? random() : '0' + random() % 10);
    const std::string complaint = complaintAbout(text);
    EXPECT_EQ(complaint.find('\n'), std::string::npos);
    files += complaint == "no complaint";
  }
  EXPECT_GT(files, 100);
}

TEST(Gltf, DeepNestingDoesNotMatter) {
  const std::string deep = std::string(1000000, '[') + std::string(1000000, ']');
  std::string text = tubeFile().json("x");
  text.insert(1, "\"extras\":" + deep + ",");
  EXPECT_THROW(fileOf(text), Error); // there is no file x
}

// A square in two triangles under two nodes, the outer of which mirrors.
GltfMaker squareFile() {
  GltfMaker maker;
  auto& d = maker.document;
  d["nodes"] = {{{"scale", {-2, 1, 1}}, {"children", {1}}}, {{"translation", {1, 0, 5}}, {"mesh", 0}}};
  nlohmann::json attributes;
  attributes["POSITION"] = maker.addFloats("VEC3", 3, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  attributes["NORMAL"] = maker.addFloats("VEC3", 3, {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  attributes["TANGENT"] = maker.addFloats("VEC4", 4, {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, -1, 0.6, 0.8, 0, -1});
  attributes["TEXCOORD_0"] = maker.add<uint8_t>("VEC2", 5121, 2, {0, 255, 255, 255, 255, 0, 0, 0}, true, 4);
  d["meshes"] = {{{"primitives",
                   {{{"attributes", attributes},
                     {"indices", maker.add<uint8_t>("SCALAR", 5121, 1, {0, 1, 2, 0, 2, 3})}}}}}};
  return maker;
}

GltfMesh meshOf(const GltfMaker& maker) {
  std::ofstream(folder() / "mesh.glb", std::ios::binary) << maker.glb();
  return readGltfMesh(folder() / "mesh.glb");
}

TEST(Gltf, MeshesAtRestAreWhereTheirNodesPutThem) {
  const TexturedMesh mesh = meshOf(squareFile()).mesh;
  ASSERT_EQ(mesh.mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.mesh.positions[2].raw(), Vec3<float>(-4, 1, 5));
  // The mirror turns the winding, so that triangles face where normals point.
  for (size_t i = 0; i < 2; ++i) EXPECT_GT(areaVector(mesh.mesh, i).z(), 0);
  for (const auto& n : mesh.normals) EXPECT_EQ(n.normalized(), Vec3<double>::UnitZ());
  EXPECT_EQ(mesh.tangents[2], Vec3<double>(-2, 0, 0));
  EXPECT_LT((mesh.tangents[3] - Vec3<double>(-1.2, 0.8, 0)).norm(), 1e-6);
  EXPECT_EQ(mesh.textureCoordinates[0], Vec2<double>(0, 0)); // v of the file goes down
  EXPECT_EQ(mesh.textureCoordinates[2], Vec2<double>(1, 1));
}

TEST(Gltf, TangentsWithoutNormalsAreIgnored) {
  GltfMaker maker = squareFile();
  maker.document["meshes"][0]["primitives"][0]["attributes"].erase("NORMAL");
  EXPECT_TRUE(meshOf(maker).mesh.tangents.empty());
}

TEST(Gltf, WhatSomePrimitivesLackIsZeroThere) {
  GltfMaker maker = squareFile();
  auto& primitives = maker.document["meshes"][0]["primitives"];
  primitives.push_back({{"attributes", {{"POSITION", primitives[0]["attributes"]["POSITION"]}}},
                        {"indices", primitives[0]["indices"]}});
  std::swap(primitives[0], primitives[1]);
  const TexturedMesh mesh = meshOf(maker).mesh;
  ASSERT_EQ(mesh.textureCoordinates.size(), 8u);
  EXPECT_EQ(mesh.textureCoordinates[2], Vec2<double>(0, 0));
  EXPECT_EQ(mesh.textureCoordinates[6], Vec2<double>(1, 1));
  EXPECT_EQ(mesh.normals[0], Vec3<double>(0, 0, 0));
  EXPECT_EQ(mesh.normals[4].normalized(), Vec3<double>::UnitZ());
  EXPECT_EQ(mesh.tangents[6], Vec3<double>(-2, 0, 0));
}

TEST(Gltf, MeshesAtRestAreThoseOfTheSkinAsBound) {
  const GltfFile rig = fileOf(tubeFile().glb());
  const TexturedMesh mesh = readGltfMesh(folder() / "rig.glb").mesh;
  ASSERT_EQ(mesh.mesh.positions.size(), rig.skeleton.vertices.size());
  for (size_t i = 0; i < mesh.mesh.positions.size(); ++i)
    EXPECT_LT((mesh.mesh.positions[i].cast<double>().raw() - rig.skeleton.vertices[i]).norm(), 1e-6);
  EXPECT_EQ(mesh.mesh.triangles, rig.skeleton.triangles);
  EXPECT_TRUE(mesh.textureCoordinates.empty());
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_EQ(readGltfMesh(folder() / "rig.glb").contentHash, rig.contentHash);
}

TEST(Gltf, WhatIsWrongWithAMeshAtRestIsSaid) {
  const auto complaint = [](auto change) {
    GltfMaker maker = squareFile();
    change(maker.document);
    try {
      meshOf(maker);
    } catch (const Error& error) {
      return std::string(error.what()).substr(error.file().size() + 2);
    }
    return std::string("no complaint");
  };
  EXPECT_EQ(complaint([](auto& d) { d["extensionsRequired"] = {"KHR_texture_transform"}; }),
            "extensionsRequired[0]: found \"KHR_texture_transform\", expected no required extension of shape "
            "or motion");
  EXPECT_EQ(complaint([](auto& d) { d["nodes"][1].erase("mesh"); }),
            "nodes: found none, expected a node with a mesh");
  EXPECT_EQ(complaint([](auto& d) { d["nodes"][1]["mesh"] = 3; }),
            "nodes[1].mesh: found 3, expected an integer in 0..0");
  EXPECT_EQ(complaint([](auto& d) { d["accessors"][3]["count"] = 3; }),
            "meshes[0].primitives[0].attributes.TEXCOORD_0: found 3, expected 4 elements, as positions");
  EXPECT_EQ(complaint([](auto& d) { d["accessors"][3]["type"] = "VEC3"; }),
            "accessors[3].type: found \"VEC3\", expected VEC2");
  EXPECT_EQ(
      complaint([](auto& d) {
        d["nodes"][0]["scale"] = {1e38, 1, 1};
        d["nodes"][1]["translation"] = {1e3, 0, 0};
      }),
      "meshes[0].primitives[0].attributes: found one beyond it, expected positions within single precision");
}

} // namespace
} // namespace surflect::warp
