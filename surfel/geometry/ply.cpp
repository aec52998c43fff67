#include "surfel/geometry/ply.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>

namespace surflect {

namespace {

enum class Encoding { ascii, littleEndian, bigEndian };
enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct PropertyDeclaration {
  Type value{};
  std::optional<Type> listCount;
};

size_t sizeOf(Type type) {
  switch (type) {
  case Type::int8:
  case Type::uint8:
    return 1;
  case Type::int16:
  case Type::uint16:
    return 2;
  case Type::int32:
  case Type::uint32:
  case Type::float32:
    return 4;
  case Type::float64:
    return 8;
  }
  return 0;
}

Type parseType(std::string_view word) {
  constexpr std::pair<std::string_view, Type> names[] = {
      {"char", Type::int8},      {"int8", Type::int8},       {"uchar", Type::uint8},
      {"uint8", Type::uint8},    {"short", Type::int16},     {"int16", Type::int16},
      {"ushort", Type::uint16},  {"uint16", Type::uint16},   {"int", Type::int32},
      {"int32", Type::int32},    {"uint", Type::uint32},     {"uint32", Type::uint32},
      {"float", Type::float32},  {"float32", Type::float32}, {"double", Type::float64},
      {"float64", Type::float64}};
  for (const auto& [name, type] : names)
    if (name == word) return type;
  throw Error::mismatch("a PLY number type", "'" + std::string(word) + "'");
}

std::vector<std::string_view> wordsOf(std::string_view line) {
  std::vector<std::string_view> words;
  for (size_t i = 0; i < line.size();) {
    const size_t begin = line.find_first_not_of(" \t\r", i);
    if (begin == std::string_view::npos) break;
    const size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    i = end;
  }
  return words;
}

template <class T> T bigOrLittle(const char* bytes, bool swap) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (swap) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

// Reads the numbers of the body in sequence.
class Body {
public:
  Body(std::string_view bytes, Encoding encoding) : rest_(bytes), encoding_(encoding) {}

  size_t bytesLeft() const { return rest_.size(); }
  // Lower bound of the bytes per number, to check counts before memory is allocated.
  size_t smallestSize(Type type) const { return encoding_ == Encoding::ascii ? 1 : sizeOf(type); }

  double next(Type type) { return encoding_ == Encoding::ascii ? nextWord() : nextBinary(type); }

private:
  double nextWord() {
    const size_t begin = rest_.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos) throw Error("ends too early");
    const size_t end = std::min(rest_.find_first_of(" \t\r\n", begin), rest_.size());
    const std::string_view word = rest_.substr(begin, end - begin);
    double value = 0;
    const auto [stop, status] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (status != std::errc() || stop != word.data() + word.size())
      throw Error::mismatch("a number", "'" + std::string(word.substr(0, 40)) + "'");
    rest_.remove_prefix(end);
    return value;
  }

  double nextBinary(Type type) {
    const size_t size = sizeOf(type);
    if (rest_.size() < size) throw Error("ends too early");
    const char* bytes = rest_.data();
    rest_.remove_prefix(size);
    const bool swap = encoding_ == Encoding::bigEndian;
    switch (type) {
    case Type::int8:
      return bigOrLittle<int8_t>(bytes, swap);
    case Type::uint8:
      return bigOrLittle<uint8_t>(bytes, swap);
    case Type::int16:
      return bigOrLittle<int16_t>(bytes, swap);
    case Type::uint16:
      return bigOrLittle<uint16_t>(bytes, swap);
    case Type::int32:
      return bigOrLittle<int32_t>(bytes, swap);
    case Type::uint32:
      return bigOrLittle<uint32_t>(bytes, swap);
    case Type::float32:
      return bigOrLittle<float>(bytes, swap);
    case Type::float64:
      return bigOrLittle<double>(bytes, swap);
    }
    return 0;
  }

  std::string_view rest_;
  Encoding encoding_;
};

struct Header {
  Encoding encoding{};
  std::vector<PlyElement> elements;                         // without values yet
  std::vector<std::vector<PropertyDeclaration>> properties; // one list per element
  size_t bodyOffset = 0;
};

Header parseHeader(std::string_view text) {
  Header header;
  bool hasFormat = false;
  size_t lineNumber = 0;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) break;
    const auto words = wordsOf(text.substr(begin, end - begin));
    begin = end + 1;
    const std::string where = "header line " + std::to_string(++lineNumber);
    try {
      if (lineNumber == 1) {
        if (words.size() != 1 || words[0] != "ply") throw Error::mismatch("the word 'ply'", "something else");
      } else if (words.empty() || words[0] == "comment" || words[0] == "obj_info") {
        continue;
      } else if (words[0] == "format" && words.size() == 3) {
        hasFormat = true;
        if (words[1] == "ascii")
          header.encoding = Encoding::ascii;
        else if (words[1] == "binary_little_endian")
          header.encoding = Encoding::littleEndian;
        else if (words[1] == "binary_big_endian")
          header.encoding = Encoding::bigEndian;
        else
          throw Error::mismatch("ascii, binary_little_endian or binary_big_endian", words[1]);
      } else if (words[0] == "element" && words.size() == 3) {
        size_t count = 0;
        const auto [stop, status] =
            std::from_chars(words[2].data(), words[2].data() + words[2].size(), count);
        if (status != std::errc() || stop != words[2].data() + words[2].size())
          throw Error::mismatch("a count", "'" + std::string(words[2]) + "'");
        header.elements.push_back({std::string(words[1]), count, {}});
        header.properties.emplace_back();
      } else if (words[0] == "property" && !header.elements.empty() &&
                 (words.size() == 3 || words.size() == 5)) {
        const bool isList = words.size() == 5;
        if (isList && words[1] != "list") throw Error::mismatch("'list'", "'" + std::string(words[1]) + "'");
        header.properties.back().push_back(
            {parseType(words[words.size() - 2]), isList ? std::optional(parseType(words[2])) : std::nullopt});
        header.elements.back().properties.push_back({std::string(words.back()), isList, {}, {}});
      } else if (words[0] == "end_header" && words.size() == 1) {
        if (!hasFormat) throw Error("no format line before end_header");
        header.bodyOffset = begin;
        return header;
      } else {
        throw Error::mismatch("format, element, property, comment or end_header",
                              "'" + std::string(words[0].substr(0, 40)) + "'");
      }
    } catch (Error& error) {
      throw std::move(error).at(where);
    }
  }
  throw Error("no end_header").at("header");
}

void readElement(Body& body, const std::vector<PropertyDeclaration>& declarations, PlyElement& element,
                 const Progress& progress) {
  size_t smallestItem = 0;
  for (const auto& d : declarations) smallestItem += body.smallestSize(d.listCount.value_or(d.value));
  if (smallestItem == 0 ? element.count > 0 : element.count > body.bytesLeft() / smallestItem)
    throw Error::mismatch("at most as many items as the file has bytes for", std::to_string(element.count))
        .at(element.name);
  for (size_t p = 0; p < declarations.size(); ++p) {
    PlyProperty& property = element.properties[p];
    if (property.isList) property.start.assign(1, 0);
    property.values.reserve(element.count);
  }
  for (size_t item = 0; item < element.count; ++item) {
    progress.checkNowAndThen(item);
    for (size_t p = 0; p < declarations.size(); ++p) {
      const auto& [type, listCount] = declarations[p];
      PlyProperty& property = element.properties[p];
      try {
        if (!listCount) {
          property.values.push_back(body.next(type));
          continue;
        }
        const double length = body.next(*listCount);
        if (!(length >= 0) || length > static_cast<double>(body.bytesLeft() / body.smallestSize(type) + 1))
          throw Error::mismatch("a list that fits the file", "length " + std::to_string(length));
        for (size_t i = 0; i < static_cast<size_t>(length); ++i) {
          property.values.push_back(body.next(type));
          progress.checkNowAndThen(property.values.size());
        }
        property.start.push_back(property.values.size());
      } catch (Error& error) {
        throw std::move(error).at(property.name).at("[" + std::to_string(item) + "]").at(element.name);
      }
    }
  }
}

} // namespace

const PlyProperty* PlyElement::find(std::string_view property) const {
  for (const auto& p : properties)
    if (p.name == property) return &p;
  return nullptr;
}

std::span<const double> PlyElement::scalars(std::string_view property) const {
  const PlyProperty* found = find(property);
  if (!found || found->isList)
    throw Error::mismatch("a number property '" + std::string(property) + "'", found ? "a list" : "none")
        .at(name);
  return found->values;
}

const PlyElement* PlyFile::find(std::string_view element) const {
  for (const auto& e : elements)
    if (e.name == element) return &e;
  return nullptr;
}

PlyFile parsePly(std::string_view content, const Progress& progress) {
  Header header = parseHeader(content);
  Body body(content.substr(header.bodyOffset), header.encoding);
  for (size_t e = 0; e < header.elements.size(); ++e)
    readElement(body, header.properties[e], header.elements[e], progress);
  return {std::move(header.elements)};
}

PlyFile readPly(const std::filesystem::path& path, const Progress& progress) {
  const std::string content = readFile(path, kLargestFile, progress);
  try {
    return parsePly(content, progress);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

void writePly(const std::filesystem::path& path, std::string_view element, std::span<const PlyColumn> columns,
              std::string_view comment) {
  static_assert(std::endian::native == std::endian::little);
  const size_t count = columns.empty() ? 0 : columns[0].values.size();
  std::string header = "ply\nformat binary_little_endian 1.0\ncomment " + std::string(comment) +
                       "\nelement " + std::string(element) + " " + std::to_string(count) + "\n";
  for (const auto& column : columns) {
    assert(column.values.size() == count);
    header += "property float " + column.name + "\n";
  }
  header += "end_header\n";
  std::vector<float> body;
  body.reserve(count * columns.size());
  for (size_t i = 0; i < count; ++i)
    for (const auto& column : columns) body.push_back(column.values[i]);
  AtomicFile file(path);
  file.write(header);
  file.write(std::as_bytes(std::span(body)));
  file.commit();
}

std::optional<std::vector<std::vector<float>>> parseWrittenPly(std::string_view content,
                                                               std::string_view element,
                                                               std::span<const std::string_view> columns,
                                                               const Progress& progress) {
  const Header header = parseHeader(content);
  if (header.encoding != Encoding::littleEndian || header.elements.size() != 1) return std::nullopt;
  const PlyElement& only = header.elements[0];
  const auto isFloat = [](const PropertyDeclaration& d) { return !d.listCount && d.value == Type::float32; };
  if (only.name != element || !std::ranges::all_of(header.properties[0], isFloat)) return std::nullopt;
  std::vector<size_t> places;
  for (const std::string_view column : columns) {
    const PlyProperty* found = only.find(column);
    if (!found) return std::nullopt;
    places.push_back(static_cast<size_t>(found - only.properties.data()));
  }
  const std::string_view body = content.substr(header.bodyOffset);
  const size_t rowBytes = sizeof(float) * only.properties.size();
  if (rowBytes == 0 || only.count > body.size() / rowBytes) return std::nullopt;

  std::vector<std::vector<float>> values(columns.size(), std::vector<float>(only.count));
  for (size_t i = 0; i < only.count; ++i) {
    progress.checkNowAndThen(i);
    const char* row = body.data() + i * rowBytes;
    for (size_t c = 0; c < columns.size(); ++c)
      std::memcpy(&values[c][i], row + sizeof(float) * places[c], sizeof(float));
  }
  return values;
}

namespace {

uint32_t vertexIndex(double value, size_t vertices, size_t item) {
  if (!(value >= 0) || value >= static_cast<double>(vertices))
    throw Error::mismatch("an index below " + std::to_string(vertices), std::to_string(value))
        .at("[" + std::to_string(item) + "]");
  return static_cast<uint32_t>(value);
}

bool hasScalar(const PlyElement& element, const char* name) {
  const PlyProperty* property = element.find(name);
  return property && !property->isList;
}

void addPositions(const PlyElement& vertices, const Vec3<double>& origin, FaceList& list,
                  const Progress& progress) {
  const auto x = vertices.scalars("x"), y = vertices.scalars("y"), z = vertices.scalars("z");
  for (size_t i = 0; i < vertices.count; ++i) {
    progress.checkNowAndThen(i);
    list.positions.push_back(assume<Point3<AcquisitionSpace>>(
        Vec3<float>((Vec3<double>(x[i], y[i], z[i]) - origin).cast<float>())));
    if (!list.positions.back().raw().allFinite())
      throw Error::mismatch("finite coordinates",
                            numberText(x[i]) + ' ' + numberText(y[i]) + ' ' + numberText(z[i]))
          .at("vertex[" + std::to_string(i) + "]");
  }
}

// Adds texture coordinates by any of their usual names.
void addTextureCoordinates(const PlyElement& vertices, FaceList& list) {
  for (const auto& [s, t] : {std::pair{"s", "t"}, std::pair{"u", "v"}, std::pair{"texture_u", "texture_v"}}) {
    if (!hasScalar(vertices, s) || !hasScalar(vertices, t)) continue;
    const auto first = vertices.scalars(s), second = vertices.scalars(t);
    for (size_t i = 0; i < vertices.count; ++i) {
      list.textureCoordinates.emplace_back(first[i], second[i]);
      if (!list.textureCoordinates.back().allFinite())
        throw Error::mismatch("finite texture coordinates",
                              numberText(first[i]) + ' ' + numberText(second[i]))
            .at("vertex[" + std::to_string(i) + "]");
    }
    return;
  }
}

void addNormals(const PlyElement& vertices, FaceList& list) {
  if (!hasScalar(vertices, "nx") || !hasScalar(vertices, "ny") || !hasScalar(vertices, "nz")) return;
  const auto x = vertices.scalars("nx"), y = vertices.scalars("ny"), z = vertices.scalars("nz");
  for (size_t i = 0; i < vertices.count; ++i) {
    const Vec3<double> normal(x[i], y[i], z[i]);
    list.normals.push_back(normal.allFinite() ? normal : Vec3<double>(0, 0, 0));
  }
}

// Adds a face's texture coordinates, two numbers per corner; none if the face has none. Returns the index of
// the first.
std::optional<uint32_t> addFaceCoordinates(const PlyProperty* property, size_t face, size_t corners,
                                           FaceList& list) {
  const size_t first = property ? property->start[face] : 0,
               count = property ? property->start[face + 1] - first : 0;
  if (count == 0) return std::nullopt;
  if (count != 2 * corners)
    throw Error::mismatch(std::to_string(2 * corners) + " numbers, two a corner", std::to_string(count))
        .at("texcoord")
        .at("[" + std::to_string(face) + "]");
  const auto place = static_cast<uint32_t>(list.textureCoordinates.size());
  for (size_t i = first; i < first + count; i += 2) {
    list.textureCoordinates.emplace_back(property->values[i], property->values[i + 1]);
    if (!list.textureCoordinates.back().allFinite())
      throw Error::mismatch("finite numbers", "others").at("texcoord").at("[" + std::to_string(face) + "]");
  }
  return place;
}

void addFaces(const PlyElement& element, const PlyProperty& lists, bool wantsAll, FaceList& list,
              const Progress& progress) {
  const PlyProperty* coordinates = wantsAll ? element.find("texcoord") : nullptr;
  if (coordinates && !coordinates->isList) coordinates = nullptr;
  const bool haveTexture = !list.textureCoordinates.empty(), haveNormals = !list.normals.empty();
  for (size_t f = 0; f + 1 < lists.start.size(); ++f) {
    progress.checkNowAndThen(f);
    const size_t first = lists.start[f], corners = lists.start[f + 1] - first;
    if (corners < 3) continue;
    const std::optional<uint32_t> ofFace = addFaceCoordinates(coordinates, f, corners, list);
    for (uint32_t i = 0; i < corners; ++i) {
      const uint32_t vertex = vertexIndex(lists.values[first + i], list.positions.size(), f);
      list.corners.push_back({vertex,
                              ofFace        ? *ofFace + i
                              : haveTexture ? vertex
                                            : FaceList::kNone,
                              haveNormals ? vertex : FaceList::kNone});
    }
    list.endFace();
  }
}

// Adds triangle strips; the winding alternates, -1 starts a new strip.
void addStrips(const PlyElement&, const PlyProperty& lists, bool, FaceList& list, const Progress& progress) {
  const bool haveTexture = !list.textureCoordinates.empty(), haveNormals = !list.normals.empty();
  for (size_t s = 0; s + 1 < lists.start.size(); ++s) {
    std::vector<FaceList::Corner> strip;
    for (size_t i = lists.start[s]; i < lists.start[s + 1]; ++i) {
      if (lists.values[i] == -1) {
        strip.clear();
        continue;
      }
      progress.checkNowAndThen(i);
      const uint32_t vertex = vertexIndex(lists.values[i], list.positions.size(), s);
      strip.push_back(
          {vertex, haveTexture ? vertex : FaceList::kNone, haveNormals ? vertex : FaceList::kNone});
      const size_t n = strip.size();
      if (n < 3) continue;
      const auto a = strip[n - 3], b = strip[n - 2];
      list.corners.insert(list.corners.end(), {n % 2 ? a : b, n % 2 ? b : a, strip[n - 1]});
      list.endFace();
    }
  }
}

// Texture coordinates and normals only if wanted.
FaceList readFaces(const std::filesystem::path& path, bool wantsAll, const Vec3<double>& origin,
                   const Progress& progress) {
  const PlyFile ply = readPly(path, progress);
  try {
    FaceList list;
    const PlyElement* vertices = ply.find("vertex");
    if (!vertices) throw Error::mismatch("an element 'vertex'", "none");
    addPositions(*vertices, origin, list, progress);
    if (wantsAll) {
      addTextureCoordinates(*vertices, list);
      addNormals(*vertices, list);
    }
    for (const auto& [element, add] : {std::pair{"face", &addFaces}, std::pair{"tristrips", &addStrips}})
      if (const PlyElement* found = ply.find(element))
        for (const char* name : {"vertex_indices", "vertex_index"})
          if (const PlyProperty* lists = found->find(name); lists && lists->isList) {
            try {
              add(*found, *lists, wantsAll, list, progress);
            } catch (Error& error) {
              throw std::move(error).at(element);
            }
          }
    return list;
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace

TriangleMesh readPlyMesh(const std::filesystem::path& path, const MeshReading& reading,
                         const Progress& progress) {
  return meshOf(readFaces(path, false, reading.origin, progress), reading.faces, progress);
}

TexturedMesh readTexturedPly(const std::filesystem::path& path, const Progress& progress) {
  return texturedMeshOf(readFaces(path, true, {0, 0, 0}, progress), Faces::cut, progress);
}

} // namespace surflect
