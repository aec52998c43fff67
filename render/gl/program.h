// Shader programs.
#pragma once

#include "render/gl/buffers.h"

#include <Eigen/Core>

#include <functional>
#include <initializer_list>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::gl {

// Shader sources of a folder, as surflect_shaders() in cmake/SurflectTargets.cmake compiles them into the
// binary.
struct ShaderFile {
  std::string_view path; // from the root of the sources: "render/gl/example.frag"
  std::string_view text;
};
using ShaderFolder = std::span<const ShaderFile>;

// Place of a line in the sources.
struct ShaderLine {
  std::string_view path;
  int number = 0; // from 1
  friend bool operator==(const ShaderLine&, const ShaderLine&) = default;
};

// A shader with the files that it includes, each once. Lines `#include "NAME"` name files of its folder.
struct CompleteShader {
  std::string text;
  std::vector<ShaderLine> lines; // of the text
};

// Throws Error naming the file if one is missing.
CompleteShader completeShader(ShaderFolder folder, std::string_view fileName);

// Line of the first error in a compiler's log, from 1; 0 if the log does not tell. Mesa writes
// "0:12(5): error: ...", NVIDIA "0(12) : error ...".
int lineOfFirstError(std::string_view log);

class Program {
public:
  // Compiles and links files of a folder; their extensions tell the stages (.vert, .frag). Throws Error with
  // file, line and the compiler's log.
  Program(ShaderFolder folder, std::initializer_list<std::string_view> fileNames);

  unsigned name() const { return handle_.name(); }

  // Sets a uniform, an element of an array ("weights[2]") or a member ("lamp.color"), which keeps its value
  // until it is set again. Throws Error if the program does not use a uniform of that name.
  void set(std::string_view uniform, int value);
  void set(std::string_view uniform, float value);
  void set(std::string_view uniform, const Eigen::Vector2f& value);
  void set(std::string_view uniform, const Eigen::Vector3f& value);
  void set(std::string_view uniform, const Eigen::Vector4f& value);
  // Sets the first elements of an array, which is named by its first: "corners[0]".
  void set(std::string_view uniform, std::span<const Eigen::Vector4f> values);
  void set(std::string_view uniform, const Eigen::Matrix3f& value);
  void set(std::string_view uniform, const Eigen::Matrix4f& value);

private:
  int locationOf(std::string_view uniform) const;

  Handle handle_;
  std::string files_; // for messages
  std::map<std::string, int, std::less<>> locations_;
};

} // namespace surflect::gl
