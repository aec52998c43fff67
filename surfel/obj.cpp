#include "surfel/obj.h"

#include "surfel/error.h"
#include "surfel/file.h"

#include <algorithm>
#include <charconv>
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

Point3<AcquisitionSpace> asPosition(const std::vector<std::string_view>& words) {
  if (words.size() < 4) throw Error::mismatch("three coordinates", std::to_string(words.size() - 1)).at("v");
  float xyz[3];
  for (size_t i = 0; i < 3; ++i) xyz[i] = static_cast<float>(asNumber<double>(words[i + 1], "a number"));
  const Point3<AcquisitionSpace> position(xyz[0], xyz[1], xyz[2]);
  if (!position.raw().allFinite()) throw Error::mismatch("finite coordinates", "a value that is not").at("v");
  return position;
}

// "7", "7/1", "7//3", "7/1/3" or "-1": from 0 on, and perhaps beyond the vertices still to come.
size_t asCorner(std::string_view word, size_t verticesSoFar) {
  const auto index = asNumber<long long>(word.substr(0, word.find('/')), "a vertex number");
  if (index > 0) return static_cast<size_t>(index) - 1;
  if (index == 0 || static_cast<size_t>(-(index + 1)) >= verticesSoFar)
    throw Error::mismatch("a vertex of 1.." + std::to_string(verticesSoFar) + " or -1..-" +
                              std::to_string(verticesSoFar),
                          std::to_string(index));
  return verticesSoFar - static_cast<size_t>(-(index + 1)) - 1;
}

struct Face {
  std::array<size_t, 3> corners;
  size_t line;
};

} // namespace

TriangleMesh parseObj(std::string_view text, const Progress& progress) {
  TriangleMesh mesh;
  std::vector<Face> faces;
  Statements statements(text);
  const auto onLine = [](size_t line) { return "line " + std::to_string(line); };
  while (statements.next()) {
    progress.checkNowAndThen(statements.line());
    const auto& words = statements.words();
    try {
      if (words[0] == "v") mesh.positions.push_back(asPosition(words));
      if (words[0] != "f") continue;
      if (words.size() < 4)
        throw Error::mismatch("at least three corners", std::to_string(words.size() - 1)).at("f");
      const auto corner = [&](size_t i) { return asCorner(words[i], mesh.positions.size()); };
      for (size_t i = 3; i < words.size(); ++i)
        faces.push_back({{corner(1), corner(i - 1), corner(i)}, statements.line()});
    } catch (Error& error) {
      throw std::move(error).at(onLine(statements.line()));
    }
  }
  for (const Face& face : faces) {
    progress.checkNowAndThen(mesh.triangles.size());
    for (const size_t corner : face.corners)
      if (corner >= mesh.positions.size())
        throw Error::mismatch("a vertex of 1.." + std::to_string(mesh.positions.size()),
                              std::to_string(corner + 1))
            .at(onLine(face.line));
    const auto index = [&](size_t i) { return static_cast<uint32_t>(face.corners[i]); };
    mesh.triangles.push_back({index(0), index(1), index(2)});
  }
  return mesh;
}

TriangleMesh readObj(const std::filesystem::path& path, const Progress& progress) {
  const std::string text = readFile(path, kLargestFile, progress);
  try {
    return parseObj(text, progress);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace surflect
