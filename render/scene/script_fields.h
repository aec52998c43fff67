// Values of a script: entries that know their field, tables that refuse unknown keys, tracks.
#pragma once

#include "surfel/base/error.h"
#include "warp/track.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::scene {

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
