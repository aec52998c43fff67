#include "render/gl/shader_file.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>

namespace surflect::gl {

namespace {

// Calls visit(line) with each line, without its end.
template <class Visit> void forEachLine(std::string_view text, const Visit& visit) {
  while (!text.empty()) {
    const size_t end = std::min(text.find('\n'), text.size());
    visit(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

const ShaderFile& fileOf(ShaderFolder folder, std::string_view name) {
  for (const ShaderFile& file : folder)
    if (std::filesystem::path(file.path).filename() == name) return file;
  throw Error::mismatch("a shader of this folder", "'" + std::string(name) + "'");
}

// Name in a line `#include "NAME"`; empty for other lines.
std::string_view includedBy(std::string_view line) {
  constexpr std::string_view kInclude = "#include \"";
  if (!line.starts_with(kInclude)) return {};
  line.remove_prefix(kInclude.size());
  return line.substr(0, line.find('"'));
}

using Included = std::set<std::string_view>; // paths

void append(ShaderFolder folder, const ShaderFile& file, Included& included, CompleteShader& shader) {
  included.insert(file.path);
  int number = 0;
  forEachLine(file.text, [&](std::string_view line) {
    const ShaderLine place{file.path, ++number};
    if (const std::string_view name = includedBy(line); !name.empty()) {
      try {
        const ShaderFile& other = fileOf(folder, name);
        if (!included.contains(other.path)) append(folder, other, included, shader);
      } catch (Error& e) {
        throw std::move(e).at("line " + std::to_string(number)).in(file.path);
      }
      return;
    }
    (shader.text += line) += '\n';
    shader.lines.push_back(place);
  });
}

} // namespace

CompleteShader completeShader(ShaderFolder folder, std::string_view fileName) {
  CompleteShader shader;
  Included included;
  append(folder, fileOf(folder, fileName), included, shader);
  return shader;
}

int lineOfFirstError(std::string_view log) {
  int found = 0;
  forEachLine(log, [&](std::string_view line) {
    if (found > 0 || line.find("error") == line.npos) return;
    const std::string text(line);
    int source = 0, number = 0, column = 0;
    if (std::sscanf(text.c_str(), "%d:%d(%d)", &source, &number, &column) == 3 ||
        std::sscanf(text.c_str(), "%d(%d)", &source, &number) == 2)
      found = number;
  });
  return found;
}

} // namespace surflect::gl
