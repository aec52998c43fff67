#include "surfel/geometry/obj.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <charconv>
#include <string>
#include <string_view>

namespace surflect {

namespace {

using Corner = FaceList::Corner;

// Statements of an OBJ file: lines without comments, joined after a backslash at the end.
class Statements {
public:
  explicit Statements(std::string_view text) : rest_(text) {}

  // Reads the next statement, if any; its words are valid until the next call.
  bool next() {
    words_.clear();
    while (!rest_.empty()) {
      firstLine_ = line_ + 1;
      while (takeLine()) {
      }
      if (!words_.empty()) return true;
    }
    return false;
  }
  const std::vector<std::string_view>& words() const { return words_; }
  size_t line() const { return firstLine_; }

private:
  // Reads a line; returns whether the statement continues on the next one.
  bool takeLine() {
    const size_t end = std::min(rest_.find('\n'), rest_.size());
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++line_;
    line = line.substr(0, line.find('#'));
    if (line.ends_with('\r')) line.remove_suffix(1);
    const bool continues = line.ends_with('\\');
    if (continues) line.remove_suffix(1);
    addWords(line);
    return continues && !rest_.empty();
  }

  void addWords(std::string_view line) {
    constexpr std::string_view blanks = " \t\v\f\r";
    for (size_t begin = line.find_first_not_of(blanks); begin != std::string_view::npos;) {
      const size_t end = std::min(line.find_first_of(blanks, begin), line.size());
      words_.push_back(line.substr(begin, end - begin));
      begin = line.find_first_not_of(blanks, end);
    }
  }

  std::string_view rest_;
  std::vector<std::string_view> words_;
  size_t line_ = 0, firstLine_ = 0;
};

template <class T> T asNumber(std::string_view word, std::string_view expected) {
  T value{};
  const char* const end = word.data() + word.size();
  const char* const begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const auto [stop, status] = std::from_chars(begin, end, value);
  if (status != std::errc() || stop != end)
    throw Error::mismatch(expected, "'" + std::string(word.substr(0, 40)) + "'");
  return value;
}

// Words after the first, joined for a message.
std::string joined(const std::vector<std::string_view>& words) {
  std::string line;
  for (size_t i = 1; i < words.size() && line.size() < 60; ++i)
    line += ' ' + std::string(words[i].substr(0, 40));
  return line.substr(1);
}

Point3<AcquisitionSpace> asPosition(const std::vector<std::string_view>& words, const Vec3<double>& origin) {
  if (words.size() < 4) throw Error::mismatch("three coordinates", std::to_string(words.size() - 1)).at("v");
  float xyz[3];
  for (size_t i = 0; i < 3; ++i)
    xyz[i] =
        static_cast<float>(asNumber<double>(words[i + 1], "a number") - origin[static_cast<Eigen::Index>(i)]);
  const Point3<AcquisitionSpace> position(xyz[0], xyz[1], xyz[2]);
  if (!position.raw().allFinite()) throw Error::mismatch("finite coordinates", joined(words)).at("v");
  return position;
}

// Index "7" or "-1" of `kind`, from 0; may refer to a later definition.
uint32_t asIndex(std::string_view word, size_t soFar, const std::string& kind) {
  const auto index = asNumber<long long>(word, "a " + kind + " number");
  if (index > 0) return static_cast<uint32_t>(std::min<long long>(index - 1, FaceList::kNone - 1));
  if (index == 0 || static_cast<size_t>(-(index + 1)) >= soFar)
    throw Error::mismatch("a " + kind + " of 1.." + std::to_string(soFar) + " or -1..-" +
                              std::to_string(soFar),
                          std::to_string(index));
  return static_cast<uint32_t>(soFar - static_cast<size_t>(-(index + 1)) - 1);
}

// Reads 2 coordinates; files have 1 to 3.
Vec2<double> asTextureCoordinates(const std::vector<std::string_view>& words) {
  if (words.size() < 2) throw Error::mismatch("a coordinate", "none").at("vt");
  Vec2<double> st(0, 0);
  for (size_t i = 1; i < std::min<size_t>(words.size(), 3); ++i)
    st[static_cast<Eigen::Index>(i) - 1] = asNumber<double>(words[i], "a number");
  if (!st.allFinite()) throw Error::mismatch("finite coordinates", joined(words)).at("vt");
  return st;
}

Vec3<double> asNormal(const std::vector<std::string_view>& words) {
  if (words.size() < 4) throw Error::mismatch("three coordinates", std::to_string(words.size() - 1)).at("vn");
  Vec3<double> normal;
  for (size_t i = 0; i < 3; ++i)
    normal[static_cast<Eigen::Index>(i)] = asNumber<double>(words[i + 1], "a number");
  if (!normal.allFinite()) throw Error::mismatch("finite coordinates", joined(words)).at("vn");
  return normal;
}

std::string onLine(size_t line) { return "line " + std::to_string(line); }

void requireBelow(uint32_t index, size_t count, const char* kind, size_t line) {
  if (index != FaceList::kNone && index >= count)
    throw Error::mismatch("a " + std::string(kind) + " of 1.." + std::to_string(count),
                          std::to_string(index + 1))
        .at(onLine(line));
}

// All faces, with checked indices; texture coordinates and normals only if wanted.
FaceList parse(std::string_view text, bool wantsAll, const Vec3<double>& origin, const Progress& progress) {
  FaceList content;
  std::vector<size_t> lines; // #faces
  Statements statements(text);
  // "7", "7/1", "7//3", "7/1/3"
  const auto asCorner = [&](std::string_view word) -> Corner {
    const size_t slash = word.find('/');
    const uint32_t vertex = asIndex(word.substr(0, slash), content.positions.size(), "vertex");
    Corner corner{vertex, FaceList::kNone, FaceList::kNone};
    if (!wantsAll || slash == std::string_view::npos) return corner;
    const std::string_view rest = word.substr(slash + 1);
    const size_t second = std::min(rest.find('/'), rest.size());
    const std::string_view texture = rest.substr(0, second),
                           normal = rest.substr(std::min(second + 1, rest.size()));
    if (!texture.empty())
      corner.texture = asIndex(texture, content.textureCoordinates.size(), "texture coordinate");
    if (!normal.empty()) corner.normal = asIndex(normal, content.normals.size(), "normal");
    return corner;
  };
  while (statements.next()) {
    progress.checkNowAndThen(statements.line());
    const auto& words = statements.words();
    try {
      if (words[0] == "v") content.positions.push_back(asPosition(words, origin));
      if (words[0] == "vt" && wantsAll) content.textureCoordinates.push_back(asTextureCoordinates(words));
      if (words[0] == "vn" && wantsAll) content.normals.push_back(asNormal(words));
      if (words[0] != "f") continue;
      if (words.size() < 4)
        throw Error::mismatch("at least three corners", std::to_string(words.size() - 1)).at("f");
      for (size_t i = 1; i < words.size(); ++i) content.corners.push_back(asCorner(words[i]));
      content.endFace();
      lines.push_back(statements.line());
    } catch (Error& error) {
      throw std::move(error).at(onLine(statements.line()));
    }
  }
  for (size_t f = 0; f < lines.size(); ++f) {
    progress.checkNowAndThen(f);
    for (size_t i = content.start[f]; i < content.start[f + 1]; ++i) {
      const auto& [vertex, texture, normal] = content.corners[i];
      requireBelow(vertex, content.positions.size(), "vertex", lines[f]);
      requireBelow(texture, content.textureCoordinates.size(), "texture coordinate", lines[f]);
      requireBelow(normal, content.normals.size(), "normal", lines[f]);
    }
  }
  return content;
}

// Runs parse(text) on the file's content.
template <class Parse> auto ofFile(const std::filesystem::path& path, const Progress& progress, Parse parse) {
  const std::string text = readFile(path, kLargestFile, progress);
  try {
    return parse(text);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace

TriangleMesh parseObj(std::string_view text, const MeshReading& reading, const Progress& progress) {
  return meshOf(parse(text, false, reading.origin, progress), reading.faces, progress);
}

TexturedMesh parseTexturedObj(std::string_view text, const Progress& progress) {
  return texturedMeshOf(parse(text, true, {0, 0, 0}, progress), Faces::cut, progress);
}

TriangleMesh readObj(const std::filesystem::path& path, const MeshReading& reading,
                     const Progress& progress) {
  return ofFile(path, progress, [&](std::string_view text) { return parseObj(text, reading, progress); });
}

TexturedMesh readTexturedObj(const std::filesystem::path& path, const Progress& progress) {
  return ofFile(path, progress, [&](std::string_view text) { return parseTexturedObj(text, progress); });
}

} // namespace surflect
