// JSON of a glTF 2.0 file and its arrays of numbers.
//
// [glTF] The Khronos Group: glTF 2.0 Specification, 2.0.1.
#pragma once

#include "surfel/math/space.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::warp {

// A value of the JSON with its path, which every Error names.
class GltfField {
public:
  struct Value; // of the JSON library
  GltfField(const Value& value, std::string path);

  const std::string& path() const { return path_; }
  [[noreturn]] void refuse(std::string_view expected) const;

  // Member of an object, if present.
  std::optional<GltfField> find(const std::string& key) const;
  GltfField require(const std::string& key) const;
  // Elements of an array.
  std::vector<GltfField> elements() const;
  // Elements of an array in an object; empty if the object has no such key.
  std::vector<GltfField> elementsOf(const std::string& key) const;

  size_t integer(size_t most) const; // 0..most
  size_t index(size_t count) const;  // index into a list of `count` things
  double number() const;             // finite
  bool boolean() const;
  std::string text() const;
  Eigen::VectorXd numbers(int count) const; // finite

private:
  std::shared_ptr<const Value> value_;
  std::string path_;
};

// Allowed component types of an accessor.
enum class GltfNumbers { floats, floatsOrNormalized, integers };

// Reads .glb, and .gltf with its buffers inside, or in files in its folder or below.
class GltfDocument {
public:
  // Throws Error, also for another version, and for a required extension whose name begins with none of the
  // given prefixes.
  GltfDocument(const std::filesystem::path& path, std::span<const std::string_view> passedOver);
  ~GltfDocument();

  GltfField root() const;
  uint64_t contentHash() const; // of the file and of its buffers

  // All numbers of the referenced accessor, `width` per element. Accessors may share bytes, so the total is
  // limited to 2^26 numbers. Throws Error, also for a number that is not finite and for a sparse accessor.
  std::vector<double> read(const GltfField& reference, std::string_view type, size_t width, GltfNumbers kind);

private:
  struct Content;
  std::unique_ptr<Content> content_;
};

} // namespace surflect::warp
