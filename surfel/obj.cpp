#include "surfel/obj.h"

#include "surfel/error.h"
#include "surfel/file.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <map>
#include <string>
#include <string_view>

namespace surflect {

namespace {

// The statements of an OBJ file one after the other: lines, joined where one ends in a backslash, without
// comments.
class Statements {
public:
  explicit Statements(std::string_view text) : rest_(text) {}

  // Whether there is another one; its words live until the next call.
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
  // Whether the statement goes on in the next line.
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

// The words after the first, as they stand in a message.
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

// "7" or "-1", of `kind`: from 0 on, and perhaps beyond those still to come.
size_t asIndex(std::string_view word, size_t soFar, const std::string& kind) {
  const auto index = asNumber<long long>(word, "a " + kind + " number");
  if (index > 0) return static_cast<size_t>(index) - 1;
  if (index == 0 || static_cast<size_t>(-(index + 1)) >= soFar)
    throw Error::mismatch("a " + kind + " of 1.." + std::to_string(soFar) + " or -1..-" +
                              std::to_string(soFar),
                          std::to_string(index));
  return soFar - static_cast<size_t>(-(index + 1)) - 1;
}

// 2 coordinates, 1 or 3.
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

constexpr size_t kNone = std::numeric_limits<size_t>::max();

struct Corner {
  size_t vertex, texture, normal;

  auto operator<=>(const Corner&) const = default;
};

struct Face {
  std::array<Corner, 3> corners;
  size_t line;
};

struct Content {
  std::vector<Point3<AcquisitionSpace>> positions;
  std::vector<Vec2<double>> textureCoordinates;
  std::vector<Vec3<double>> normals;
  std::vector<Face> faces; // whose vertices are there
};

std::string onLine(size_t line) { return "line " + std::to_string(line); }

void requireBelow(size_t index, size_t count, const char* kind, size_t line) {
  if (index != kNone && index >= count)
    throw Error::mismatch("a " + std::string(kind) + " of 1.." + std::to_string(count),
                          std::to_string(index + 1))
        .at(onLine(line));
}

Content parse(std::string_view text, bool wantsAll, const Vec3<double>& origin, const Progress& progress) {
  Content content;
  Statements statements(text);
  // "7", "7/1", "7//3", "7/1/3"
  const auto asCorner = [&](std::string_view word) -> Corner {
    const size_t slash = word.find('/');
    const size_t vertex = asIndex(word.substr(0, slash), content.positions.size(), "vertex");
    Corner corner{vertex, kNone, kNone};
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
      for (size_t i = 3; i < words.size(); ++i)
        content.faces.push_back(
            {{asCorner(words[1]), asCorner(words[i - 1]), asCorner(words[i])}, statements.line()});
    } catch (Error& error) {
      throw std::move(error).at(onLine(statements.line()));
    }
  }
  for (size_t i = 0; i < content.faces.size(); ++i) {
    progress.checkNowAndThen(i);
    for (const auto& [vertex, texture, normal] : content.faces[i].corners) {
      requireBelow(vertex, content.positions.size(), "vertex", content.faces[i].line);
      requireBelow(texture, content.textureCoordinates.size(), "texture coordinate", content.faces[i].line);
      requireBelow(normal, content.normals.size(), "normal", content.faces[i].line);
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

TriangleMesh parseObj(std::string_view text, const Progress& progress, const Vec3<double>& origin) {
  Content content = parse(text, false, origin, progress);
  TriangleMesh mesh{std::move(content.positions), {}};
  for (const Face& face : content.faces) {
    progress.checkNowAndThen(mesh.triangles.size());
    const auto index = [&](size_t i) { return static_cast<uint32_t>(face.corners[i].vertex); };
    mesh.triangles.push_back({index(0), index(1), index(2)});
  }
  return mesh;
}

TexturedMesh parseTexturedObj(std::string_view text, const Progress& progress) {
  const Content content = parse(text, true, Vec3<double>::Zero(), progress);
  const auto allHave = [&](size_t Corner::*what) {
    return std::ranges::all_of(content.faces, [&](const Face& face) {
      return std::ranges::find(face.corners, kNone, what) == face.corners.end();
    });
  };
  const bool hasTexture = allHave(&Corner::texture), hasNormals = allHave(&Corner::normal);
  TexturedMesh textured;
  std::map<Corner, uint32_t> vertices;
  const auto vertexOf = [&](Corner corner) {
    if (!hasTexture) corner.texture = kNone;
    if (!hasNormals) corner.normal = kNone;
    const auto next = static_cast<uint32_t>(textured.corner.size());
    const auto [found, isNew] = vertices.try_emplace(corner, next);
    if (isNew) {
      textured.mesh.positions.push_back(content.positions[corner.vertex]);
      textured.corner.push_back(static_cast<uint32_t>(corner.vertex));
      if (hasTexture) textured.textureCoordinates.push_back(content.textureCoordinates[corner.texture]);
      if (hasNormals) textured.normals.push_back(content.normals[corner.normal]);
    }
    return found->second;
  };
  for (const Face& face : content.faces) {
    progress.checkNowAndThen(textured.mesh.triangles.size());
    const uint32_t a = vertexOf(face.corners[0]), b = vertexOf(face.corners[1]),
                   c = vertexOf(face.corners[2]);
    textured.mesh.triangles.push_back({a, b, c});
  }
  return textured;
}

TriangleMesh readObj(const std::filesystem::path& path, const Progress& progress,
                     const Vec3<double>& origin) {
  return ofFile(path, progress, [&](std::string_view text) { return parseObj(text, progress, origin); });
}

TexturedMesh readTexturedObj(const std::filesystem::path& path, const Progress& progress) {
  return ofFile(path, progress, [&](std::string_view text) { return parseTexturedObj(text, progress); });
}

} // namespace surflect
