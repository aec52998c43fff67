// Values of a script: entries that know their field, tables that refuse unknown keys, tracks.
#pragma once

#include "surfel/base/error.h"
#include "warp/track.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::scene {

// Check that TOML is not nested too deeply. The TOML library frees and copies tables by recursion, which
// would overflow the stack; its own limit counts nested values, but not the dots of keys.
inline constexpr int kDeepestToml = 64; // scripts and stages need 6

namespace shallow_toml {

// Returns the index after the string that begins at `i`. A string in """ or ''' may span lines; one in " or '
// ends with its line at the latest.
inline size_t pastString(std::string_view toml, size_t i) {
  const char quote = toml[i];
  const auto quotesAt = [&](size_t at) { // at most 5
    size_t count = 0;
    while (count < 5 && at + count < toml.size() && toml[at + count] == quote) ++count;
    return count;
  };
  const size_t opening = quotesAt(i);
  if (opening == 2) return i + 2; // empty
  const size_t marks = opening >= 3 ? 3 : 1;
  for (i += marks; i < toml.size(); ++i) {
    if (toml[i] == '\\' && quote == '"')
      ++i;
    else if (toml[i] == '\n' && marks == 1)
      return i;
    else if (const size_t count = quotesAt(i); count >= marks)
      return i + (marks == 3 ? count : 1); // two quotes may end what """ holds
  }
  return toml.size();
}

} // namespace shallow_toml

// Returns the first line, counted from 1, on which tables and arrays are nested deeper than `deepest`; empty
// if there is none. Brackets and the dots of a key both nest. In text that is not valid TOML, the result is
// meaningful only up to the first error.
inline std::optional<int> tooDeepLine(std::string_view toml, int deepest) {
  struct Bracket {
    bool isTable;
    int depth; // outside
  };
  std::vector<Bracket> open;
  int line = 1, ofHeader = 0, depth = 0;
  bool inKey = true, isHeader = false, isLineEmpty = true;
  const auto close = [&] {
    if (open.empty()) return;
    depth = open.back().depth;
    open.pop_back();
    inKey = false;
  };
  for (size_t i = 0; i < toml.size();) {
    const char c = toml[i];
    if (c == '"' || c == '\'') {
      const size_t end = shallow_toml::pastString(toml, i);
      for (; i < end; ++i) line += toml[i] == '\n';
      isLineEmpty = false;
      continue;
    }
    if (c == '#') {
      i = toml.find('\n', i);
      if (i == toml.npos) break;
      continue;
    }
    ++i;
    if (c == '\n') {
      ++line;
      if (!open.empty()) continue;
      if (isHeader) ofHeader = depth;
      depth = ofHeader;
      inKey = isLineEmpty = true;
      isHeader = false;
      continue;
    }
    if (c == ' ' || c == '\t') continue;
    if (isLineEmpty && open.empty() && c == '[') { // [header] or [[header]]
      isHeader = true;
      depth = 1;
    } else if (!isHeader && (c == '[' || c == '{')) {
      open.push_back({c == '{', depth++});
      inKey = c == '{';
    } else if (!isHeader && (c == ']' || c == '}')) {
      close();
    } else if (c == ',' && !open.empty()) {
      depth = open.back().depth + 1;
      inKey = open.back().isTable;
    } else if (c == '=') {
      inKey = false;
    } else if (c == '.' && inKey) {
      ++depth;
    }
    isLineEmpty = false;
    if (depth > deepest) return line;
  }
  return std::nullopt;
}

// A value in a script. It lives as long as its ScriptDocument.
struct Entry {
  const void* node;                    // a toml::node; only script_fields.cpp knows that type
  std::string field;                   // "warp[1].axis"
  const std::filesystem::path* folder; // the script's own, from which its paths start
  const Vec3<double>* origin;          // subtracted from places
};

class ScriptDocument {
public:
  // Throws Error where the text is not TOML, or deeper than kDeepestToml. `path` is the script's.
  ScriptDocument(std::string_view text, const std::filesystem::path& path);
  ~ScriptDocument();
  Entry root() const;

  // Subtracts `origin` from all places read from now on; entries taken earlier stay valid.
  void countFrom(const Vec3<double>& origin);

  // Overrides the root with the table [group.name]: its tables are merged into the root's tables of the same
  // name, its other values replace the root's. Entries taken earlier become invalid. Throws Error if there is
  // no such table.
  void prefer(std::string_view group, std::string_view name);

private:
  struct Parsed;
  std::unique_ptr<Parsed> parsed_;
};

using Keys = std::vector<std::string_view>;

// A table whose keys are all known; an unknown one is an Error that names the nearest.
class Section {
public:
  Section(const Entry& table, const Keys& known);
  size_t size() const;
  std::optional<Entry> find(std::string_view key) const;
  Entry require(std::string_view key) const; // an Error when it is missing
  const Entry& table() const { return table_; }

private:
  Entry table_;
};

// "found ..., expected ..." at the entry.
Error mismatch(const Entry& entry, std::string_view expected);
// Mismatch with an entry that should be one of the names; suggests the nearest.
Error noneOf(const Entry& entry, const Keys& names);

bool isText(const Entry& entry);
// Throw Error at the entry where it is something else.
std::string asText(const Entry& entry); // not empty
std::filesystem::path asPath(const Entry& entry);
double asNumber(const Entry& entry); // finite
double numberIn(const Entry& entry, double least, double most);
Vec3<double> asVector(const Entry& entry); // [x, y, z], within 1e9
int asInteger(const Entry& entry, int least, int most);
bool asBoolean(const Entry& entry);
std::vector<Entry> asArray(const Entry& entry, std::string_view expected);

warp::Track asTrack(const Entry& entry);
warp::Track3 asTrack3(const Entry& entry);
// Coordinates of a place, from which the origin is subtracted.
warp::Track3 asPlace(const Entry& entry);
warp::Track trackOr(const Section& section, std::string_view key, double otherwise);
warp::Track3 trackOr(const Section& section, std::string_view key, const warp::Track3& otherwise);
// Coordinates of a place, 0 if the key is missing. Throws Error for a missing key unless the origin is 0.
warp::Track3 placeOrOrigin(const Section& section, std::string_view key);

// Returns make(); an Error that it throws gets the entry's field.
template <class Make> auto at(const Entry& entry, Make make) {
  try {
    return make();
  } catch (Error& error) {
    throw std::move(error).at(entry.field);
  }
}

// Returns make(), which reads a file named by the entry; the message of an Error follows the entry's field.
template <class Make> auto atFile(const Entry& entry, Make make) {
  try {
    return make();
  } catch (const Error& error) {
    throw Error(error.what()).at(entry.field);
  }
}

template <class Names> std::string listed(const Names& names) {
  std::string list;
  for (const std::string_view name : names) list += (list.empty() ? "" : ", ") + std::string(name);
  return list;
}

// One choice of `type`: its name, its other keys, and how it is read.
template <class Value> struct Kind {
  std::string_view type;
  Keys keys;
  Value (*read)(const Section&);
};

// The entry's `type`, one of the given; an Error otherwise.
size_t typeOf(const Entry& table, const Keys& types);

template <class Value>
std::vector<Value> asList(const std::optional<Entry>& entry, const std::vector<Kind<Value>>& kinds) {
  std::vector<Value> values;
  if (!entry) return values;
  Keys types;
  for (const auto& kind : kinds) types.push_back(kind.type);
  for (const Entry& element : asArray(*entry, "tables under [[" + entry->field + "]]")) {
    const Kind<Value>& kind = kinds[typeOf(element, types)];
    Keys known = kind.keys;
    known.push_back("type");
    values.push_back(kind.read(Section(element, known)));
  }
  return values;
}

} // namespace surflect::scene
