#include "render/gl/program.h"

#include "render/gl/context.h"
#include "surfel/base/error.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>
#include <vector>

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

namespace {

GLenum stageOf(std::string_view fileName) {
  if (fileName.ends_with(".vert")) return GL_VERTEX_SHADER;
  if (fileName.ends_with(".frag")) return GL_FRAGMENT_SHADER;
  throw Error::mismatch("a shader .vert or .frag", "'" + std::string(fileName) + "'");
}

// A log on one line.
std::string oneLine(std::string log) {
  while (!log.empty() && (log.back() == '\n' || log.back() == '\0')) log.pop_back();
  for (size_t at = log.find('\n'); at != log.npos; at = log.find('\n', at)) log.replace(at, 1, "; ");
  return log;
}

Handle compiled(ShaderFolder folder, std::string_view fileName) {
  const CompleteShader source = completeShader(folder, fileName);
  Handle shader(glCreateShader(stageOf(fileName)), [](unsigned name) { glDeleteShader(name); });
  const char* text = source.text.c_str();
  glShaderSource(shader.name(), 1, &text, nullptr);
  glCompileShader(shader.name());
  GLint succeeded = 0, length = 0;
  glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &succeeded);
  if (succeeded) return shader;
  glGetShaderiv(shader.name(), GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<size_t>(length), '\0');
  glGetShaderInfoLog(shader.name(), length, nullptr, log.data());
  const auto line = static_cast<size_t>(lineOfFirstError(log)); // 0 if unknown
  if (line == 0 || line > source.lines.size()) throw Error(oneLine(log)).in(fileName);
  const ShaderLine& place = source.lines[line - 1];
  throw Error(oneLine(log)).at("line " + std::to_string(place.number)).in(place.path);
}

Handle linked(const std::vector<Handle>& shaders, const std::string& files) {
  Handle program(glCreateProgram(), [](unsigned name) { glDeleteProgram(name); });
  for (const Handle& shader : shaders) glAttachShader(program.name(), shader.name());
  glLinkProgram(program.name());
  for (const Handle& shader : shaders) glDetachShader(program.name(), shader.name());
  GLint succeeded = 0, length = 0;
  glGetProgramiv(program.name(), GL_LINK_STATUS, &succeeded);
  if (succeeded) return program;
  glGetProgramiv(program.name(), GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<size_t>(length), '\0');
  glGetProgramInfoLog(program.name(), length, nullptr, log.data());
  throw Error("does not link: " + oneLine(log)).in(files);
}

std::string joined(std::initializer_list<std::string_view> names) {
  std::string text;
  for (std::string_view name : names) text += (text.empty() ? "" : ", ") + std::string(name);
  return text;
}

Handle built(ShaderFolder folder, std::initializer_list<std::string_view> fileNames) {
  std::vector<Handle> shaders;
  for (std::string_view fileName : fileNames) shaders.push_back(compiled(folder, fileName));
  return linked(shaders, joined(fileNames));
}

} // namespace

Program::Program(ShaderFolder folder, std::initializer_list<std::string_view> fileNames)
    : handle_(built(folder, fileNames)), files_(joined(fileNames)) {
  GLint count = 0, longest = 0;
  glGetProgramiv(name(), GL_ACTIVE_UNIFORMS, &count);
  glGetProgramiv(name(), GL_ACTIVE_UNIFORM_MAX_LENGTH, &longest);
  std::string uniform(static_cast<size_t>(longest), '\0');
  for (GLint i = 0; i < count; ++i) {
    GLint size = 0;
    GLenum type = 0;
    glGetActiveUniform(name(), static_cast<GLuint>(i), longest, nullptr, &size, &type, uniform.data());
    // An array is named by its first element, "x[0]".
    const std::string first = uniform.c_str(), array = first.substr(0, first.rfind('['));
    for (GLint k = 0; k < size; ++k) {
      const std::string element = size > 1 ? array + "[" + std::to_string(k) + "]" : first;
      locations_[element] = glGetUniformLocation(name(), element.c_str());
    }
  }
  requireNoErrors();
}

int Program::locationOf(std::string_view uniform) const {
  const auto found = locations_.find(uniform);
  if (found == locations_.end())
    throw Error::mismatch("a uniform that the program uses", "'" + std::string(uniform) + "'").in(files_);
  return found->second;
}

void Program::set(std::string_view uniform, int value) {
  glProgramUniform1i(name(), locationOf(uniform), value);
}
void Program::set(std::string_view uniform, float value) {
  glProgramUniform1f(name(), locationOf(uniform), value);
}
void Program::set(std::string_view uniform, const Eigen::Vector2f& value) {
  glProgramUniform2fv(name(), locationOf(uniform), 1, value.data());
}
void Program::set(std::string_view uniform, const Eigen::Vector3f& value) {
  glProgramUniform3fv(name(), locationOf(uniform), 1, value.data());
}
void Program::set(std::string_view uniform, const Eigen::Vector4f& value) {
  glProgramUniform4fv(name(), locationOf(uniform), 1, value.data());
}
void Program::set(std::string_view uniform, std::span<const Eigen::Vector4f> values) {
  static_assert(sizeof(Eigen::Vector4f) == 4 * sizeof(float));
  if (values.empty()) return;
  glProgramUniform4fv(name(), locationOf(uniform), static_cast<GLsizei>(values.size()), values[0].data());
}
void Program::set(std::string_view uniform, const Eigen::Matrix3f& value) {
  glProgramUniformMatrix3fv(name(), locationOf(uniform), 1, GL_FALSE, value.data());
}
void Program::set(std::string_view uniform, const Eigen::Matrix4f& value) {
  glProgramUniformMatrix4fv(name(), locationOf(uniform), 1, GL_FALSE, value.data());
}

} // namespace surflect::gl
