#include "warp/gltf_document.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace surflect::warp {

struct GltfField::Value {
  const nlohmann::json& json;
};

namespace {

using nlohmann::json;

constexpr size_t mostNumbers = size_t{1} << 26;

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

// Returns whether a file is inside the folder after following links. A foreign file must not name private
// files of the user, or endless ones of the system.
bool isInside(const std::filesystem::path& file, const std::filesystem::path& folder) {
  std::error_code problem;
  const auto root = std::filesystem::canonical(folder.empty() ? "." : folder, problem),
             place = problem ? root : std::filesystem::canonical(file, problem);
  return !problem && std::mismatch(root.begin(), root.end(), place.begin(), place.end()).first == root.end();
}

std::string readBuffer(const GltfField& buffer, const Container& container, bool first,
                       const std::filesystem::path& folder) {
  const auto uri = buffer.find("uri");
  std::string bytes;
  if (!uri) {
    if (!first || !container.hasBinary) throw Error("has neither a uri nor a chunk").at(buffer.path());
    bytes = container.binary;
  } else if (const std::string text = uri->text(); text.starts_with("data:")) {
    const size_t comma = text.find(";base64,");
    if (comma == std::string::npos) uri->refuse("base64 data");
    try {
      bytes = fromBase64(std::string_view(text).substr(comma + 8));
    } catch (Error& error) {
      throw std::move(error).at(uri->path());
    }
  } else {
    const std::filesystem::path path = folder / fromUri(text);
    if (text.find('\0') != std::string::npos || fromUri(text).find('\0') != std::string::npos)
      uri->refuse("the name of a file");
    if (std::error_code ignored; !std::filesystem::is_regular_file(path, ignored))
      throw Error::mismatch("a file", "none of this name").at(uri->path()).in(path);
    if (!isInside(path, folder))
      uri->refuse("a file in the folder of the glTF, also after links are followed");
    bytes = readFile(path);
  }
  const size_t length = buffer.require("byteLength").integer(std::numeric_limits<uint32_t>::max());
  if (length > bytes.size())
    throw Error::mismatch("at most " + std::to_string(bytes.size()) + ", the bytes that are there",
                          std::to_string(length))
        .at(buffer.path() + ".byteLength");
  return bytes;
}

struct Component {
  size_t size = 0;
  bool isSigned = false, isFloat = false;

  // [glTF, §3.6.2.2 and §3.11]: the value of a normalised integer is c / (2^n - 1), or for signed ones max(c
  // / (2^(n-1) - 1), -1).
  double at(const char* bytes, bool normalized) const {
    if (isFloat) {
      float value;
      std::memcpy(&value, bytes, sizeof value);
      return value;
    }
    const uint32_t raw = littleEndian({bytes, size}, 0, size);
    const double values = std::ldexp(1, static_cast<int>(8 * size));
    double value = raw;
    if (isSigned && value >= values / 2) value -= values;
    if (!normalized) return value;
    return isSigned ? std::max(value / (values / 2 - 1), -1.0) : value / (values - 1);
  }
};

Component componentOf(const GltfField& field) {
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

size_t offsetIn(const GltfField& field, size_t length) {
  const auto offset = field.find("byteOffset");
  return offset ? offset->integer(length) : 0;
}

void checkAsset(const GltfField& root, std::span<const std::string_view> passedOver) {
  const GltfField version = root.require("asset").require("version");
  if (!version.text().starts_with("2.")) version.refuse("2.0");
  for (const GltfField& extension : root.elementsOf("extensionsRequired"))
    if (const std::string name = extension.text(); std::ranges::none_of(
            passedOver, [&](std::string_view beginning) { return name.starts_with(beginning); }))
      extension.refuse("no required extension of shape or motion");
}

} // namespace

GltfField::GltfField(const Value& value, std::string path)
    : value_(std::make_shared<Value>(value)), path_(std::move(path)) {}

void GltfField::refuse(std::string_view expected) const {
  throw Error::mismatch(expected, shown(value_->json)).at(path_);
}

std::optional<GltfField> GltfField::find(const std::string& key) const {
  if (!value_->json.is_object()) refuse("an object");
  const auto found = value_->json.find(key);
  if (found == value_->json.end()) return std::nullopt;
  return GltfField(Value{*found}, path_.empty() ? key : path_ + '.' + key);
}

GltfField GltfField::require(const std::string& key) const {
  if (const auto field = find(key)) return *field;
  throw Error("missing").at(path_.empty() ? key : path_ + '.' + key);
}

std::vector<GltfField> GltfField::elements() const {
  if (!value_->json.is_array()) refuse("an array");
  std::vector<GltfField> fields;
  for (size_t i = 0; i < value_->json.size(); ++i)
    fields.emplace_back(Value{value_->json[i]}, path_ + '[' + std::to_string(i) + ']');
  return fields;
}

std::vector<GltfField> GltfField::elementsOf(const std::string& key) const {
  const auto field = find(key);
  return field ? field->elements() : std::vector<GltfField>();
}

size_t GltfField::integer(size_t most) const {
  if (!value_->json.is_number_unsigned() || value_->json.get<uint64_t>() > most)
    refuse("an integer in 0.." + std::to_string(most));
  return value_->json.get<size_t>();
}

size_t GltfField::index(size_t count) const {
  if (count == 0) refuse("no index: there is nothing of this kind");
  return integer(count - 1);
}

double GltfField::number() const {
  if (!value_->json.is_number() || !std::isfinite(value_->json.get<double>())) refuse("a finite number");
  return value_->json.get<double>();
}

bool GltfField::boolean() const {
  if (!value_->json.is_boolean()) refuse("true or false");
  return value_->json.get<bool>();
}

std::string GltfField::text() const {
  if (!value_->json.is_string()) refuse("a string");
  return value_->json.get<std::string>();
}

Eigen::VectorXd GltfField::numbers(int count) const {
  const std::vector<GltfField> fields = elements();
  if (std::ssize(fields) != count) refuse(std::to_string(count) + " numbers");
  Eigen::VectorXd result(count);
  for (int i = 0; i < count; ++i) result[i] = fields[static_cast<size_t>(i)].number();
  return result;
}

struct GltfDocument::Content {
  json root;
  std::vector<std::string> buffers;
  std::vector<GltfField> accessors, views;
  uint64_t hash = 0;
  size_t numbersRead = 0;
};

GltfDocument::GltfDocument(const std::filesystem::path& path, std::span<const std::string_view> passedOver)
    : content_(std::make_unique<Content>()) {
  const std::string bytes = readFile(path);
  const Container container = opened(bytes);
  content_->root = json::parse(container.json, nullptr, false);
  if (!content_->root.is_object()) throw Error("not glTF: no JSON object");
  checkAsset(root(), passedOver);
  std::string hashes = hex(surflect::contentHash(std::as_bytes(std::span(bytes))));
  for (const GltfField& buffer : root().elementsOf("buffers")) {
    auto& buffers = content_->buffers;
    buffers.push_back(readBuffer(buffer, container, buffers.empty(), path.parent_path()));
    hashes += hex(surflect::contentHash(std::as_bytes(std::span(buffers.back()))));
  }
  content_->hash = surflect::contentHash(std::as_bytes(std::span(hashes)));
  content_->accessors = root().elementsOf("accessors");
  content_->views = root().elementsOf("bufferViews");
}

GltfDocument::~GltfDocument() = default;

GltfField GltfDocument::root() const { return {GltfField::Value{content_->root}, ""}; }

uint64_t GltfDocument::contentHash() const { return content_->hash; }

std::vector<double> GltfDocument::read(const GltfField& reference, std::string_view type, size_t width,
                                       GltfNumbers kind) {
  const auto& accessors = content_->accessors;
  const auto& views = content_->views;
  const auto& buffers = content_->buffers;
  const GltfField& accessor = accessors[reference.index(accessors.size())];
  if (const GltfField named = accessor.require("type"); named.text() != type) named.refuse(type);
  if (const auto sparse = accessor.find("sparse")) sparse->refuse("no sparse accessor");
  const GltfField componentType = accessor.require("componentType");
  const Component component = componentOf(componentType);
  const auto normalizedField = accessor.find("normalized");
  const bool normalized = normalizedField && normalizedField->boolean();
  const bool fits = kind == GltfNumbers::integers
                        ? !component.isFloat && !component.isSigned && !normalized
                        : component.isFloat ||
                              (kind == GltfNumbers::floatsOrNormalized && normalized && component.size < 4);
  if (!fits)
    componentType.refuse(kind == GltfNumbers::integers ? "unsigned integers"
                         : kind == GltfNumbers::floats ? "5126, floating point"
                                                       : "5126, floating point, or normalized integers");

  const GltfField& view = views[accessor.require("bufferView").index(views.size())];
  const std::string& buffer = buffers[view.require("buffer").index(buffers.size())];
  const size_t viewOffset = offsetIn(view, buffer.size());
  const GltfField viewLength = view.require("byteLength");
  const size_t length = viewLength.integer(buffer.size() - viewOffset);
  const size_t offset = offsetIn(accessor, length);
  const size_t element = width * component.size;
  const auto strideField = view.find("byteStride");
  const size_t stride = strideField ? strideField->integer(252) : element;
  if (stride < element) strideField->refuse("at least " + std::to_string(element));
  const GltfField countField = accessor.require("count");
  const size_t fitting = length - offset < element ? 0 : (length - offset - element) / stride + 1;
  const size_t count = countField.integer(fitting);
  if (count == 0) countField.refuse("at least 1");
  if ((content_->numbersRead += count * width) > mostNumbers)
    throw Error::mismatch("at most " + std::to_string(mostNumbers) + " numbers in all", "more")
        .at(accessor.path());

  std::vector<double> numbers;
  numbers.reserve(count * width);
  for (size_t i = 0; i < count; ++i)
    for (size_t k = 0; k < width; ++k) {
      const char* bytes = buffer.data() + viewOffset + offset + i * stride + k * component.size;
      numbers.push_back(component.at(bytes, normalized));
      if (!std::isfinite(numbers.back()))
        throw Error::mismatch("finite numbers", "one that is not, in element " + std::to_string(i))
            .at(accessor.path());
    }
  return numbers;
}

} // namespace surflect::warp
