#include "warp/gltf.h"

#include "surfel/error.h"
#include "surfel/file.h"
#include "surfel/hash.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

namespace surflect {

namespace {

using nlohmann::json;

// Accessors may share bytes, so that a small file could ask for any amount of memory.
constexpr size_t mostNumbers = size_t{1} << 26, mostJoints = size_t{1} << 20;

std::string shown(const json& value) {
  if (value.is_string()) {
    std::string text = value.get<std::string>().substr(0, 40);
    for (char& c : text)
      if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
    return '"' + text + '"';
  }
  if (value.is_structured()) return value.is_array() ? "an array" : "an object";
  return value.dump();
}

// A value with the way to it.
struct Field {
  const json& value;
  std::string path;

  [[noreturn]] void refuse(std::string_view expected) const {
    throw Error::mismatch(expected, shown(value)).at(path);
  }
  std::optional<Field> find(const char* key) const {
    if (!value.is_object()) refuse("an object");
    const auto found = value.find(key);
    if (found == value.end()) return std::nullopt;
    return Field{*found, path.empty() ? key : path + '.' + key};
  }
  Field require(const char* key) const {
    if (const auto field = find(key)) return *field;
    throw Error("missing").at(path.empty() ? key : path + '.' + key);
  }
  std::vector<Field> elements() const {
    if (!value.is_array()) refuse("an array");
    std::vector<Field> fields;
    for (size_t i = 0; i < value.size(); ++i)
      fields.push_back({value[i], path + '[' + std::to_string(i) + ']'});
    return fields;
  }
  std::vector<Field> elementsOf(const char* key) const {
    const auto field = find(key);
    return field ? field->elements() : std::vector<Field>();
  }
  // 0..most
  size_t integer(size_t most) const {
    if (!value.is_number_unsigned() || value.get<uint64_t>() > most)
      refuse("an integer in 0.." + std::to_string(most));
    return value.get<size_t>();
  }
  // Of a list of `count` things.
  size_t index(size_t count) const {
    if (count == 0) refuse("no index: there is nothing of this kind");
    return integer(count - 1);
  }
  std::string text() const {
    if (!value.is_string()) refuse("a string");
    return value.get<std::string>();
  }
  template <int size> Eigen::Matrix<double, size, 1> numbers() const {
    const std::vector<Field> fields = elements();
    if (fields.size() != size) refuse(std::to_string(size) + " numbers");
    Eigen::Matrix<double, size, 1> result;
    for (int i = 0; i < size; ++i) {
      const json& number = fields[i].value;
      if (!number.is_number() || !std::isfinite(number.get<double>())) fields[i].refuse("a finite number");
      result[i] = number.get<double>();
    }
    return result;
  }
};

// ---- The bytes: JSON and buffers ----

uint32_t littleEndian(std::string_view bytes, size_t offset) {
  uint32_t value = 0;
  for (size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[offset + i]);
  return value;
}

struct Container {
  std::string_view json, binary;
  bool hasBinary = false;
};

// [glTF, §4.4]: 12 bytes of header, then chunks of a length, a type and that many bytes.
Container opened(std::string_view bytes) {
  constexpr uint32_t magic = 0x46546C67, jsonType = 0x4E4F534A, binaryType = 0x004E4942;
  if (!bytes.starts_with("glTF")) return {bytes, {}, false};
  static_assert(magic == ('g' | 'l' << 8 | 'T' << 16 | 'F' << 24));
  if (bytes.size() < 20) throw Error("ends in its header");
  if (const uint32_t version = littleEndian(bytes, 4); version != 2)
    throw Error::mismatch("version 2", std::to_string(version)).at("header");
  if (const uint32_t length = littleEndian(bytes, 8); length != bytes.size())
    throw Error::mismatch(std::to_string(bytes.size()) + " bytes, which the file has", std::to_string(length))
        .at("header");
  Container container;
  for (size_t offset = 12, chunk = 0; offset < bytes.size(); ++chunk) {
    const std::string name = "chunk[" + std::to_string(chunk) + "]";
    if (bytes.size() - offset < 8) throw Error("ends in its header").at(name);
    const uint32_t length = littleEndian(bytes, offset), type = littleEndian(bytes, offset + 4);
    offset += 8;
    if (length > bytes.size() - offset)
      throw Error::mismatch("at most " + std::to_string(bytes.size() - offset) + " bytes",
                            std::to_string(length))
          .at(name);
    const std::string_view content = bytes.substr(offset, length);
    if ((chunk == 0) != (type == jsonType)) throw Error("the JSON is not the first chunk").at(name);
    if (chunk == 0) container.json = content;
    if (chunk == 1 && type == binaryType) {
      container.binary = content;
      container.hasBinary = true;
    }
    offset += length;
  }
  return container;
}

std::string fromBase64(std::string_view text) {
  std::string bytes;
  uint32_t bits = 0;
  int count = 0;
  while (text.ends_with('=')) text.remove_suffix(1);
  for (const char c : text) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const size_t digit = digits.find(c);
    if (digit == std::string_view::npos) throw Error("a character that is not of base64");
    bits = bits << 6 | static_cast<uint32_t>(digit);
    if ((count += 6) >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 255);
  }
  return bytes;
}

// "a%20file.bin" -> "a file.bin"
std::string fromUri(std::string_view uri) {
  std::string name;
  const auto hex = [](char c) {
    return c >= '0' && c <= '9' ? c - '0' : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10 : -1;
  };
  for (size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && hex(uri[i + 1]) >= 0 && hex(uri[i + 2]) >= 0) {
      name += static_cast<char>(hex(uri[i + 1]) * 16 + hex(uri[i + 2]));
      i += 2;
    } else {
      name += uri[i];
    }
  }
  return name;
}

// After links have been followed. A file from elsewhere must not name what its author could not read, nor a
// file of the system's that never ends.
bool isInside(const std::filesystem::path& file, const std::filesystem::path& folder) {
  std::error_code problem;
  const auto root = std::filesystem::canonical(folder.empty() ? "." : folder, problem),
             place = problem ? root : std::filesystem::canonical(file, problem);
  return !problem && std::mismatch(root.begin(), root.end(), place.begin(), place.end()).first == root.end();
}

std::string readBuffer(const Field& buffer, const Container& container, bool first,
                       const std::filesystem::path& folder) {
  const auto uri = buffer.find("uri");
  std::string bytes;
  if (!uri) {
    if (!first || !container.hasBinary) throw Error("has neither a uri nor a chunk").at(buffer.path);
    bytes = container.binary;
  } else if (const std::string text = uri->text(); text.starts_with("data:")) {
    const size_t comma = text.find(";base64,");
    if (comma == std::string::npos) uri->refuse("base64 data");
    try {
      bytes = fromBase64(std::string_view(text).substr(comma + 8));
    } catch (Error& error) {
      throw std::move(error).at(uri->path);
    }
  } else {
    const std::filesystem::path path = folder / fromUri(text);
    if (text.find('\0') != std::string::npos || fromUri(text).find('\0') != std::string::npos)
      uri->refuse("the name of a file");
    if (std::error_code ignored; !std::filesystem::is_regular_file(path, ignored))
      throw Error::mismatch("a file", "none of this name").at(uri->path).in(path);
    if (!isInside(path, folder))
      uri->refuse("a file in the folder of the glTF, also after links are followed");
    bytes = readFile(path);
  }
  const size_t length = buffer.require("byteLength").integer(std::numeric_limits<uint32_t>::max());
  if (length > bytes.size())
    throw Error::mismatch("at most " + std::to_string(bytes.size()) + ", the bytes that are there",
                          std::to_string(length))
        .at(buffer.path + ".byteLength");
  return bytes;
}

// ---- Accessors: arrays of numbers ----

struct Component {
  size_t size = 0;
  bool isSigned = false, isFloat = false;

  // [glTF, §3.6.2.2 and §3.11]: what an integer stands for when it is normalised is c / (2^n - 1), or for
  // signed ones max(c / (2^(n-1) - 1), -1).
  double at(const char* bytes, bool normalized) const {
    if (isFloat) {
      float value;
      std::memcpy(&value, bytes, sizeof value);
      return value;
    }
    uint32_t raw = 0;
    for (size_t i = size; i-- > 0;) raw = raw << 8 | static_cast<unsigned char>(bytes[i]);
    const double values = std::ldexp(1, static_cast<int>(8 * size));
    double value = raw;
    if (isSigned && value >= values / 2) value -= values;
    if (!normalized) return value;
    return isSigned ? std::max(value / (values / 2 - 1), -1.0) : value / (values - 1);
  }
};

Component componentOf(const Field& field) {
  switch (field.integer(65535)) {
  case 5120:
    return {1, true, false};
  case 5121:
    return {1, false, false};
  case 5122:
    return {2, true, false};
  case 5123:
    return {2, false, false};
  case 5125:
    return {4, false, false};
  case 5126:
    return {4, true, true};
  default:
    field.refuse("a component type of 5120 to 5126");
  }
}

enum class Numbers { floats, floatsOrNormalized, integers };

class Reader {
public:
  Reader(const json& root, std::vector<std::string> buffers, std::filesystem::path path)
      : root_{root, ""}, buffers_(std::move(buffers)), path_(std::move(path)),
        accessors_(root_.elementsOf("accessors")), views_(root_.elementsOf("bufferViews")) {}

  const Field& root() const { return root_; }

  // All numbers of the accessor that the field names, `width` for each of its elements.
  std::vector<double> read(const Field& reference, std::string_view type, size_t width, Numbers kind) {
    const Field& accessor = accessors_[reference.index(accessors_.size())];
    if (const Field named = accessor.require("type"); named.text() != type) named.refuse(type);
    if (const auto sparse = accessor.find("sparse")) sparse->refuse("no sparse accessor");
    const Field componentType = accessor.require("componentType");
    const Component component = componentOf(componentType);
    const auto normalizedField = accessor.find("normalized");
    if (normalizedField && !normalizedField->value.is_boolean()) normalizedField->refuse("true or false");
    const bool normalized = normalizedField && normalizedField->value.get<bool>();
    const bool fits = kind == Numbers::integers ? !component.isFloat && !component.isSigned && !normalized
                                                : component.isFloat || (kind == Numbers::floatsOrNormalized &&
                                                                        normalized && component.size < 4);
    if (!fits)
      componentType.refuse(kind == Numbers::integers ? "unsigned integers"
                           : kind == Numbers::floats ? "5126, floating point"
                                                     : "5126, floating point, or normalized integers");

    const Field& view = views_[accessor.require("bufferView").index(views_.size())];
    const std::string& buffer = buffers_[view.require("buffer").index(buffers_.size())];
    const size_t viewOffset = offsetIn(view, buffer.size());
    const Field viewLength = view.require("byteLength");
    const size_t length = viewLength.integer(buffer.size() - viewOffset);
    const size_t offset = offsetIn(accessor, length);
    const size_t element = width * component.size;
    const auto strideField = view.find("byteStride");
    const size_t stride = strideField ? strideField->integer(252) : element;
    if (stride < element) strideField->refuse("at least " + std::to_string(element));
    const Field countField = accessor.require("count");
    const size_t fitting = length - offset < element ? 0 : (length - offset - element) / stride + 1;
    const size_t count = countField.integer(fitting);
    if (count == 0) countField.refuse("at least 1");
    if ((numbersRead_ += count * width) > mostNumbers)
      throw Error::mismatch("at most " + std::to_string(mostNumbers) + " numbers in all", "more")
          .at(accessor.path);

    std::vector<double> numbers;
    numbers.reserve(count * width);
    for (size_t i = 0; i < count; ++i)
      for (size_t k = 0; k < width; ++k) {
        const char* bytes = buffer.data() + viewOffset + offset + i * stride + k * component.size;
        numbers.push_back(component.at(bytes, normalized));
        if (!std::isfinite(numbers.back()))
          throw Error::mismatch("finite numbers", "one that is not, in element " + std::to_string(i))
              .at(accessor.path);
      }
    return numbers;
  }

private:
  static size_t offsetIn(const Field& field, size_t length) {
    const auto offset = field.find("byteOffset");
    return offset ? offset->integer(length) : 0;
  }

  Field root_;
  std::vector<std::string> buffers_;
  std::filesystem::path path_;
  std::vector<Field> accessors_, views_;
  size_t numbersRead_ = 0;
};

// ---- Nodes ----

// 16 numbers, column by column, whose last row is 0 0 0 1.
AffineMap asAffine(const double* m) {
  AffineMap map;
  map.linear << m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10];
  map.offset << m[12], m[13], m[14];
  return map;
}

SkeletonNode readNode(const Field& field) {
  SkeletonNode node;
  if (const auto matrix = field.find("matrix")) {
    const Eigen::Matrix<double, 16, 1> m = matrix->numbers<16>();
    node.fixed = asAffine(m.data());
  }
  if (const auto translation = field.find("translation")) node.translation = translation->numbers<3>();
  if (const auto scale = field.find("scale")) node.scale = scale->numbers<3>();
  if (const auto rotation = field.find("rotation")) {
    node.rotation.coeffs() = rotation->numbers<4>();
    if (!(node.rotation.norm() > 1e-6)) rotation->refuse("a rotation");
    node.rotation.normalize();
  }
  return node;
}

void readNodes(const std::vector<Field>& fields, Skeleton& skeleton) {
  for (const Field& field : fields) skeleton.nodes.push_back(readNode(field));
  const size_t count = fields.size();
  std::vector<std::vector<uint32_t>> children(count);
  for (size_t i = 0; i < count; ++i)
    for (const Field& child : fields[i].elementsOf("children")) {
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

// Appends the joints of a skin. Returns how many.
size_t readSkin(Reader& reader, const Field& skin, Skeleton& skeleton) {
  const std::vector<Field> joints = skin.require("joints").elements();
  // Nodes may share a skin, and a small file have any number of joints.
  if (skeleton.joints.size() + joints.size() > mostJoints)
    throw Error::mismatch("at most " + std::to_string(mostJoints) + " joints in all", "more").at(skin.path);
  std::vector<double> inverseBind;
  if (const auto field = skin.find("inverseBindMatrices")) {
    inverseBind = reader.read(*field, "MAT4", 16, Numbers::floats);
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

// Up to 4 joints a vertex from each pair of attributes JOINTS_n, WEIGHTS_n; their weights are made to sum
// to 1.
void readInfluences(Reader& reader, const Field& attributes, size_t vertices, size_t firstJoint,
                    size_t joints, Skeleton& skeleton) {
  std::vector<std::vector<double>> indices, weights;
  for (int set = 0;; ++set) {
    const auto j = attributes.find(("JOINTS_" + std::to_string(set)).c_str()),
               w = attributes.find(("WEIGHTS_" + std::to_string(set)).c_str());
    if (!j && !w && set > 0) break;
    if (!j || !w) throw Error("has no JOINTS_n and WEIGHTS_n of equal n").at(attributes.path);
    indices.push_back(reader.read(*j, "VEC4", 4, Numbers::integers));
    weights.push_back(reader.read(*w, "VEC4", 4, Numbers::floatsOrNormalized));
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
        if (set[k] < 0) throw Error::mismatch("none below 0", "a weight of " + place).at(attributes.path);
        sum += set[k];
      }
    if (!(sum > 1e-6))
      throw Error::mismatch("at least one weight above 0", "none at " + place).at(attributes.path);
    skeleton.firstInfluence.push_back(static_cast<uint32_t>(skeleton.influences.size()));
    for (size_t s = 0; s < weights.size(); ++s)
      for (size_t k = 4 * v; k < 4 * v + 4; ++k) {
        if (weights[s][k] == 0) continue;
        if (!(indices[s][k] < static_cast<double>(joints)))
          throw Error::mismatch("a joint below " + std::to_string(joints),
                                std::to_string(static_cast<uint64_t>(indices[s][k])) + " at " + place)
              .at(attributes.path);
        skeleton.influences.push_back(
            {static_cast<uint32_t>(firstJoint + static_cast<size_t>(indices[s][k])), weights[s][k] / sum});
      }
  }
}

std::vector<Vec3<double>> readVectors(Reader& reader, const Field& reference) {
  const std::vector<double> numbers = reader.read(reference, "VEC3", 3, Numbers::floats);
  std::vector<Vec3<double>> vectors;
  for (size_t i = 0; i < numbers.size(); i += 3)
    vectors.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return vectors;
}

// The positions of a primitive, which must be one of triangles.
std::vector<Vec3<double>> readPositions(Reader& reader, const Field& primitive) {
  if (const auto mode = primitive.find("mode"); mode && mode->integer(6) != 4) mode->refuse("4, triangles");
  if (const auto targets = primitive.find("targets")) targets->refuse("no morph targets");
  return readVectors(reader, primitive.require("attributes").require("POSITION"));
}

// Appends the triangles of a primitive, whose `count` vertices begin at `first`.
void readTriangles(Reader& reader, const Field& primitive, size_t first, size_t count,
                   std::vector<std::array<uint32_t, 3>>& triangles) {
  std::vector<double> corners;
  if (const auto indices = primitive.find("indices")) {
    corners = reader.read(*indices, "SCALAR", 1, Numbers::integers);
    if (std::ranges::any_of(corners, [&](double c) { return c >= static_cast<double>(count); }))
      indices->refuse("vertices below " + std::to_string(count));
  } else {
    for (size_t i = 0; i < count; ++i) corners.push_back(static_cast<double>(i));
  }
  if (corners.size() % 3 != 0) throw Error("the last triangle is not whole").at(primitive.path);
  const auto vertex = [&](size_t i) {
    return static_cast<uint32_t>(first + static_cast<size_t>(corners[i]));
  };
  for (size_t i = 0; i < corners.size(); i += 3)
    triangles.push_back({vertex(i), vertex(i + 1), vertex(i + 2)});
}

void readPrimitive(Reader& reader, const Field& primitive, size_t firstJoint, size_t joints,
                   Skeleton& skeleton) {
  const std::vector<Vec3<double>> positions = readPositions(reader, primitive);
  const size_t first = skeleton.vertices.size(), count = positions.size();
  skeleton.vertices.insert(skeleton.vertices.end(), positions.begin(), positions.end());
  readInfluences(reader, primitive.require("attributes"), count, firstJoint, joints, skeleton);
  readTriangles(reader, primitive, first, count, skeleton.triangles);
}

Skeleton readSkeleton(Reader& reader) {
  Skeleton skeleton;
  const std::vector<Field> nodes = reader.root().elementsOf("nodes"),
                           meshes = reader.root().elementsOf("meshes"),
                           skins = reader.root().elementsOf("skins");
  readNodes(nodes, skeleton);
  for (const Field& node : nodes) {
    const auto mesh = node.find("mesh"), skin = node.find("skin");
    if (!mesh || !skin) continue;
    const size_t firstJoint = skeleton.joints.size();
    const size_t joints = readSkin(reader, skins[skin->index(skins.size())], skeleton);
    for (const Field& primitive : meshes[mesh->index(meshes.size())].require("primitives").elements())
      readPrimitive(reader, primitive, firstJoint, joints, skeleton);
  }
  if (skeleton.vertices.empty()) throw Error::mismatch("a node with a mesh and a skin", "none").at("nodes");
  skeleton.firstInfluence.push_back(static_cast<uint32_t>(skeleton.influences.size()));
  return skeleton;
}

// ---- Animations ----

std::optional<Channel> readChannel(Reader& reader, const Field& field, const std::vector<Field>& samplers,
                                   const Skeleton& skeleton) {
  Channel channel;
  const Field target = field.require("target"), path = target.require("path");
  const auto node = target.find("node");
  if (!node) return std::nullopt; // of an extension
  channel.node = static_cast<uint32_t>(node->index(skeleton.nodes.size()));
  if (skeleton.nodes[channel.node].fixed) node->refuse("a node without a matrix");
  if (path.text() == "translation")
    channel.property = Channel::Property::translation;
  else if (path.text() == "rotation")
    channel.property = Channel::Property::rotation;
  else if (path.text() == "scale")
    channel.property = Channel::Property::scale;
  else
    path.refuse("translation, rotation or scale");

  const Field sampler = samplers[field.require("sampler").index(samplers.size())];
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

  const Field input = sampler.require("input"), output = sampler.require("output");
  channel.seconds = reader.read(input, "SCALAR", 1, Numbers::floats);
  for (size_t i = 1; i < channel.seconds.size(); ++i)
    if (!(channel.seconds[i] > channel.seconds[i - 1])) input.refuse("times that increase");
  const bool turns = channel.property == Channel::Property::rotation;
  const size_t width = turns ? 4 : 3;
  channel.values = reader.read(output, turns ? "VEC4" : "VEC3", width,
                               turns ? Numbers::floatsOrNormalized : Numbers::floats);
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

std::vector<GltfAnimation> readAnimations(Reader& reader, const Skeleton& skeleton) {
  std::vector<GltfAnimation> animations;
  for (const Field& field : reader.root().elementsOf("animations")) {
    GltfAnimation& animation = animations.emplace_back();
    if (const auto name = field.find("name")) animation.name = name->text();
    const std::vector<Field> samplers = field.require("samplers").elements();
    for (const Field& channel : field.require("channels").elements())
      if (auto read = readChannel(reader, channel, samplers, skeleton))
        animation.channels.push_back(std::move(*read));
  }
  return animations;
}

// ---- Meshes at rest ----

// The attribute's vectors, as many as there are vertices; `has` says whether all primitives so far have it.
std::optional<Field> attributeOfAll(const Field& attributes, const char* name, bool& has) {
  const auto field = has ? attributes.find(name) : std::nullopt;
  has = field.has_value();
  return field;
}

void appendPrimitive(Reader& reader, const Field& primitive, const AffineMap& worldFromNode,
                     TexturedMesh& mesh, bool& hasNormals, bool& hasTexture) {
  const std::vector<Vec3<double>> positions = readPositions(reader, primitive);
  const Field attributes = primitive.require("attributes");
  const size_t first = mesh.mesh.positions.size(), count = positions.size();
  for (const auto& p : positions) {
    mesh.mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(worldFromNode(p)));
    if (!mesh.mesh.positions.back().raw().allFinite())
      throw Error::mismatch("positions within single precision", "one beyond it").at(attributes.path);
  }
  // Normals go by det(A) A^-T, which exists where A has no inverse.
  const Mat3<double>& a = worldFromNode.linear;
  const bool mirrors = a.determinant() < 0;
  if (const auto field = attributeOfAll(attributes, "NORMAL", hasNormals)) {
    Mat3<double> cofactors;
    cofactors << a.col(1).cross(a.col(2)), a.col(2).cross(a.col(0)), a.col(0).cross(a.col(1));
    for (const auto& n : readVectors(reader, *field))
      mesh.normals.push_back((mirrors ? -1. : 1.) * (cofactors * n));
    if (mesh.normals.size() != first + count)
      field->refuse(std::to_string(count) + " elements, as positions");
  }
  if (const auto field = attributeOfAll(attributes, "TEXCOORD_0", hasTexture)) {
    const std::vector<double> st = reader.read(*field, "VEC2", 2, Numbers::floatsOrNormalized);
    // [glTF, §3.8.1]: the origin is the upper left corner
    for (size_t i = 0; i < st.size(); i += 2) mesh.textureCoordinates.emplace_back(st[i], 1 - st[i + 1]);
    if (mesh.textureCoordinates.size() != first + count)
      field->refuse(std::to_string(count) + " elements, as positions");
  }
  const size_t firstTriangle = mesh.mesh.triangles.size();
  readTriangles(reader, primitive, first, count, mesh.mesh.triangles);
  for (size_t i = firstTriangle; mirrors && i < mesh.mesh.triangles.size(); ++i)
    std::swap(mesh.mesh.triangles[i][1], mesh.mesh.triangles[i][2]);
}

TexturedMesh readMeshes(Reader& reader) {
  const std::vector<Field> nodes = reader.root().elementsOf("nodes"),
                           meshes = reader.root().elementsOf("meshes");
  Skeleton skeleton;
  readNodes(nodes, skeleton);
  const std::vector<AffineMap> global = globalsOf(skeleton.nodes, skeleton.order);
  TexturedMesh textured;
  bool hasNormals = true, hasTexture = true;
  for (size_t i = 0; i < nodes.size(); ++i) {
    const auto mesh = nodes[i].find("mesh");
    if (!mesh) continue;
    const AffineMap map = nodes[i].find("skin") ? AffineMap() : global[i];
    for (const Field& primitive : meshes[mesh->index(meshes.size())].require("primitives").elements())
      appendPrimitive(reader, primitive, map, textured, hasNormals, hasTexture);
  }
  if (textured.mesh.triangles.empty()) throw Error::mismatch("a node with a mesh", "none").at("nodes");
  if (!hasNormals) textured.normals.clear();
  if (!hasTexture) textured.textureCoordinates.clear();
  for (size_t i = 0; i < textured.mesh.positions.size(); ++i)
    textured.corner.push_back(static_cast<uint32_t>(i));
  return textured;
}

void checkAsset(const Field& root) {
  const Field version = root.require("asset").require("version");
  if (!version.text().starts_with("2.")) version.refuse("2.0");
  for (const Field& extension : root.elementsOf("extensionsRequired"))
    extension.refuse("no required extension");
}

// Runs read(reader, hash of all bytes) on an opened file.
template <class Read> auto ofFile(const std::filesystem::path& path, Read read) {
  const std::string bytes = readFile(path);
  try {
    const Container container = opened(bytes);
    const json root = json::parse(container.json, nullptr, false);
    if (!root.is_object()) throw Error("not glTF: no JSON object");
    const Field field{root, ""};
    checkAsset(field);
    std::string hashes = hex(contentHash(std::as_bytes(std::span(bytes))));
    std::vector<std::string> buffers;
    for (const Field& buffer : field.elementsOf("buffers")) {
      buffers.push_back(readBuffer(buffer, container, buffers.empty(), path.parent_path()));
      hashes += hex(contentHash(std::as_bytes(std::span(buffers.back()))));
    }
    Reader reader(root, std::move(buffers), path);
    return read(reader, contentHash(std::as_bytes(std::span(hashes))));
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace

GltfFile readGltf(const std::filesystem::path& path) {
  return ofFile(path, [](Reader& reader, uint64_t hash) {
    GltfFile file;
    file.skeleton = readSkeleton(reader);
    file.animations = readAnimations(reader, file.skeleton);
    file.contentHash = hash;
    return file;
  });
}

GltfMesh readGltfMesh(const std::filesystem::path& path) {
  return ofFile(path, [](Reader& reader, uint64_t hash) { return GltfMesh{readMeshes(reader), hash}; });
}

} // namespace surflect
