// The JSON of a glTF 2.0 file and the arrays of numbers that it speaks of.
//
// [glTF] The Khronos Group: glTF 2.0 Specification, 2.0.1.
#pragma once

#include "surfel/math/space.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::warp {

// A value of the JSON with the way to it, which every Error names.
class GltfField {
public:
  struct Value; // of the JSON library
  GltfField(const Value& value, std::string path);

  const std::string& path() const { return path_; }
  [[noreturn]] void refuse(std::string_view expected) const;

  // Of an object.
  std::optional<GltfField> find(const std::string& key) const;
  GltfField require(const std::string& key) const;
  // Of an array.
  std::vector<GltfField> elements() const;
  // Of an array in an object; none where the object has no such key.
  std::vector<GltfField> elementsOf(const std::string& key) const;

  size_t integer(size_t most) const; // 0..most
  size_t index(size_t count) const;  // of a list of `count` things
  double number() const;             // finite
  bool boolean() const;
  std::string text() const;
  Eigen::VectorXd numbers(int count) const; // finite

private:
  std::shared_ptr<const Value> value_;
  std::string path_;
};

// What components of an accessor may be.
enum class GltfNumbers { floats, floatsOrNormalized, integers };

// Reads .glb, and .gltf with its buffers inside, or in files in its folder or below.
class GltfDocument {
public:
  // Throws Error, also where the file is of another version, or requires an extension whose name has none of
  // the given beginnings.
  GltfDocument(const std::filesystem::path& path, std::span<const std::string_view> passedOver);
  ~GltfDocument();

  GltfField root() const;
  uint64_t contentHash() const; // of the file and of the buffers it names

  // All numbers of the accessor that the field names, `width` for each of its elements. Accessors may share
  // bytes: there are at most 2^26 numbers in all. Throws Error, also where one is not finite or the accessor
  // is sparse.
  std::vector<double> read(const GltfField& reference, std::string_view type, size_t width, GltfNumbers kind);

private:
  struct Content;
  std::unique_ptr<Content> content_;
};

} // namespace surflect::warp
