// Shader sources of a folder, as surflect_shaders() in cmake/SurflectTargets.cmake compiles them into the
// binary.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::gl {

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

} // namespace surflect::gl
