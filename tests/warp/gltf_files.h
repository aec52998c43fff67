// glTF files for tests: a tube along z whose rings follow a chain of joints.
#pragma once

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

namespace surflect::warp {

// Collects a document and its one buffer.
struct GltfMaker {
  nlohmann::json document = {{"asset", {{"version", "2.0"}}}};
  std::string binary;

  template <class T> void append(T value) {
    binary.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  // An accessor of the numbers as T; returns its index.
  template <class T>
  size_t add(const std::string& type, int componentType, size_t width, const std::vector<double>& numbers,
             bool normalized = false, size_t stride = 0) {
    while (binary.size() % 4) binary += '\0';
    const size_t begin = binary.size();
    for (size_t i = 0; i < numbers.size(); ++i) {
      append(static_cast<T>(numbers[i]));
      while (stride && (i + 1) % width == 0 && (binary.size() - begin) % stride) binary += '\x7f';
    }
    nlohmann::json view = {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", binary.size() - begin}};
    if (stride) view["byteStride"] = stride;
    document["bufferViews"].push_back(view);
    nlohmann::json accessor = {{"bufferView", document["bufferViews"].size() - 1},
                               {"componentType", componentType},
                               {"type", type},
                               {"count", numbers.size() / width}};
    if (normalized) accessor["normalized"] = true;
    document["accessors"].push_back(accessor);
    return document["accessors"].size() - 1;
  }
  size_t addFloats(const std::string& type, size_t width, const std::vector<double>& numbers) {
    return add<float>(type, 5126, width, numbers);
  }

  std::string json(const std::string& uri = "") const {
    nlohmann::json copy = document;
    copy["buffers"] = {{{"byteLength", binary.size()}}};
    if (!uri.empty()) copy["buffers"][0]["uri"] = uri;
    return copy.dump();
  }
  std::string glb() const {
    const auto chunk = [](std::string content, const char* type, char pad) {
      while (content.size() % 4) content += pad;
      return little(content.size()) + std::string(type, 4) + content;
    };
    const std::string chunks = chunk(json(), "JSON", ' ') + chunk(binary, "BIN\0", '\0');
    return "glTF" + little(2) + little(12 + chunks.size()) + chunks;
  }
  static std::string little(size_t value) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i) & 255);
    return bytes;
  }
};

// Nodes 0, 1, 2 are joints at heights 0, 1, 2, node 3 the skin: rings of `sides` corners of radius 0.3 from
// height 0 to 3, each joint giving way to the next smoothly. The animation "Turn" turns joint 1 about x and
// joint 2 about y by 90 degrees from 0 to 2 seconds.
inline GltfMaker tubeFile(int rings = 12, int sides = 8) {
  GltfMaker maker;
  auto& d = maker.document;
  d["nodes"] = {{{"children", {1}}},
                {{"translation", {0, 0, 1}}, {"children", {2}}},
                {{"translation", {0, 0, 1}}},
                {{"mesh", 0}, {"skin", 0}}};
  std::vector<double> positions, joints, weights, corners, inverse;
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < sides; ++j) {
      const double z = 3.0 * i / (rings - 1), angle = 2 * std::numbers::pi * j / sides;
      positions.insert(positions.end(), {0.3 * std::cos(angle), 0.3 * std::sin(angle), z});
      joints.insert(joints.end(), {0, 1, 2, 0});
      const auto share = [&](double at) { return 1 / (1 + std::exp(-6 * (z - at))); };
      weights.insert(weights.end(), {1 - share(1), share(1) - share(2), share(2), 0});
      if (i + 1 == rings) continue;
      const int a = i * sides + j, b = i * sides + (j + 1) % sides;
      for (const int corner : {a, b, b + sides, a, b + sides, a + sides}) corners.push_back(corner);
    }
  for (int k = 0; k < 3; ++k)
    inverse.insert(inverse.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -1.0 * k, 1});
  nlohmann::json attributes;
  attributes["POSITION"] = maker.addFloats("VEC3", 3, positions);
  attributes["JOINTS_0"] = maker.add<uint8_t>("VEC4", 5121, 4, joints);
  attributes["WEIGHTS_0"] = maker.addFloats("VEC4", 4, weights);
  d["meshes"] = {
      {{"primitives",
        {{{"attributes", attributes}, {"indices", maker.add<uint16_t>("SCALAR", 5123, 1, corners)}}}}}};
  d["skins"] = {{{"joints", {0, 1, 2}}, {"inverseBindMatrices", maker.addFloats("MAT4", 16, inverse)}}};
  const double r = std::sqrt(0.5);
  const size_t times = maker.addFloats("SCALAR", 1, {0, 2});
  const size_t turnX = maker.addFloats("VEC4", 4, {0, 0, 0, 1, r, 0, 0, r});
  const size_t turnY = maker.addFloats("VEC4", 4, {0, 0, 0, 1, 0, r, 0, r});
  d["animations"] = {
      {{"name", "Turn"},
       {"samplers", {{{"input", times}, {"output", turnX}}, {{"input", times}, {"output", turnY}}}},
       {"channels",
        {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "rotation"}}}},
         {{"sampler", 1}, {"target", {{"node", 2}, {"path", "rotation"}}}}}}}};
  return maker;
}

} // namespace surflect::warp
