#include "render/script.h"

#include "surfel/error.h"
#include "surfel/file.h"
#include "surfel/hash.h"
#include "surfel/nearest_name.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace surflect {

namespace {

// ---- TOML values with the way to them ----

// What a user typed, fit for one line of a message.
std::string shown(std::string_view typed, size_t limit = 60) {
  std::string line(typed.substr(0, limit));
  for (char& c : line)
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
  return line;
}

std::string shown(const toml::node& node) {
  std::string text = "a date or time";
  if (const auto* string = node.as_string()) text = '"' + shown(string->get()) + '"';
  if (const auto* integer = node.as_integer()) text = std::to_string(integer->get());
  if (const auto* real = node.as_floating_point()) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%g", real->get());
    text = digits;
  }
  if (const auto* boolean = node.as_boolean()) text = boolean->get() ? "true" : "false";
  if (const auto* array = node.as_array()) text = "an array of " + std::to_string(array->size());
  if (node.is_table()) text = "a table";
  return text + " on line " + std::to_string(node.source().begin.line);
}

template <class Names> std::string listed(const Names& names) {
  std::string list;
  for (const std::string_view name : names) list += (list.empty() ? "" : ", ") + std::string(name);
  return list;
}

struct Entry {
  const toml::node& node;
  std::string field; // "warp[1].axis"
};

Error mismatch(const Entry& entry, std::string_view expected) {
  return Error::mismatch(expected, shown(entry.node)).at(entry.field);
}

using Keys = std::vector<std::string_view>;

// A table whose keys are all known.
class Section {
public:
  Section(const toml::table& table, std::string field, const Keys& known)
      : table_(table), field_(std::move(field)) {
    for (const auto& [key, node] : table_) {
      const std::string name = shown(key.str());
      if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
      throw Error("unknown key on line " + std::to_string(key.source().begin.line) +
                  "; the nearest known one is " + std::string(nearestName(name, known)))
          .at(fieldOf(name));
    }
  }

  std::optional<Entry> find(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (!node) return std::nullopt;
    return Entry{*node, fieldOf(key)};
  }
  Entry require(std::string_view key) const {
    const auto entry = find(key);
    if (!entry)
      throw Error("missing from the table on line " + std::to_string(table_.source().begin.line))
          .at(fieldOf(key));
    return *entry;
  }

private:
  std::string fieldOf(std::string_view key) const {
    return field_.empty() ? std::string(key) : field_ + '.' + std::string(key);
  }

  const toml::table& table_;
  std::string field_;
};

const toml::table& asTable(const Entry& entry) {
  if (const toml::table* table = entry.node.as_table()) return *table;
  throw mismatch(entry, "a table");
}

std::string asText(const Entry& entry) {
  const auto* text = entry.node.as_string();
  if (!text || text->get().empty()) throw mismatch(entry, "a string");
  return text->get();
}

double asNumber(const Entry& entry) {
  const auto number = entry.node.value<double>();
  if (!entry.node.is_number() || !number || !std::isfinite(*number)) throw mismatch(entry, "a finite number");
  return *number;
}

int asInteger(const Entry& entry, int least, int most) {
  const auto* integer = entry.node.as_integer();
  if (!integer || integer->get() < least || integer->get() > most)
    throw mismatch(entry, "an integer in " + std::to_string(least) + ".." + std::to_string(most));
  return static_cast<int>(integer->get());
}

bool asBoolean(const Entry& entry) {
  if (const auto* boolean = entry.node.as_boolean()) return boolean->get();
  throw mismatch(entry, "true or false");
}

std::vector<Entry> asArray(const Entry& entry, std::string_view expected) {
  const toml::array* array = entry.node.as_array();
  if (!array) throw mismatch(entry, expected);
  std::vector<Entry> elements;
  for (size_t i = 0; i < array->size(); ++i)
    elements.push_back({*array->get(i), entry.field + '[' + std::to_string(i) + ']'});
  return elements;
}

// ---- Tracks ----

Keyframe asKeyframe(const Entry& entry) {
  constexpr std::string_view form = "a keyframe [frame, value] or [frame, value, \"smooth\"]";
  const std::vector<Entry> parts = asArray(entry, form);
  if (parts.size() < 2 || parts.size() > 3) throw mismatch(entry, form);
  if (parts.size() == 3 && parts[2].node.value_or(std::string_view()) != "smooth")
    throw mismatch(parts[2], "\"smooth\"");
  return {asNumber(parts[0]), asNumber(parts[1]), parts.size() == 3};
}

// Runs `make`, which may refuse what stands at the entry.
template <class Make> auto at(const Entry& entry, Make make) {
  try {
    return make();
  } catch (Error& error) {
    throw std::move(error).at(entry.field);
  }
}

Track asTrack(const Entry& entry) {
  if (entry.node.is_number()) return asNumber(entry);
  if (entry.node.is_string()) return at(entry, [&] { return Track::expression(asText(entry)); });
  std::vector<Keyframe> keys;
  for (const Entry& key : asArray(entry, "a number, a list of keyframes or an expression"))
    keys.push_back(asKeyframe(key));
  return at(entry, [&] { return Track::keyframes(std::move(keys)); });
}

Track3 asTrack3(const Entry& entry) {
  const std::vector<Entry> elements = asArray(entry, "an array of 3");
  if (elements.size() != 3) throw mismatch(entry, "an array of 3");
  return {asTrack(elements[0]), asTrack(elements[1]), asTrack(elements[2])};
}

Track trackOr(const Section& section, std::string_view key, double otherwise) {
  const auto entry = section.find(key);
  return entry ? asTrack(*entry) : Track(otherwise);
}

Track3 trackOr(const Section& section, std::string_view key, const Track3& otherwise) {
  const auto entry = section.find(key);
  return entry ? asTrack3(*entry) : otherwise;
}

// ---- The sections of a script ----

const Track3 origin{0, 0, 0}, yUp{0, 1, 0}, white{1, 1, 1};

Frames asFrames(const Entry& entry) {
  constexpr int most = 1'000'000;
  const Section section(asTable(entry), entry.field, {"first", "last", "fps"});
  Frames frames;
  frames.first = asInteger(section.require("first"), 0, most);
  frames.last = asInteger(section.require("last"), frames.first, most);
  if (const auto fps = section.find("fps")) {
    frames.fps = asNumber(*fps);
    if (frames.fps < 1e-3 || frames.fps > 1e6) throw mismatch(*fps, "frames per second in 0.001..1000000");
  }
  return frames;
}

Output asOutput(const Entry& entry) {
  const Section section(asTable(entry), entry.field, {"size", "path", "png", "aov"});
  Output output;
  const Entry size = section.require("size");
  const std::vector<Entry> sides = asArray(size, "[width, height]");
  if (sides.size() != 2) throw mismatch(size, "[width, height]");
  output.width = asInteger(sides[0], 1, 16384);
  output.height = asInteger(sides[1], 1, 16384);

  const Entry path = section.require("path");
  output.path = asText(path);
  const size_t run = std::count(output.path.begin(), output.path.end(), '#');
  const bool together = output.path.find(std::string(run, '#')) != std::string::npos;
  const bool plain = output.path.find('\0') == std::string::npos;
  if (run < 1 || run > 16 || !together || !plain || !output.path.ends_with(".exr"))
    throw mismatch(path, "a name such as \"frame.####.exr\"");

  if (const auto png = section.find("png")) output.png = asBoolean(*png);
  if (const auto aov = section.find("aov"))
    for (const Entry& name : asArray(*aov, "an array of names")) {
      const std::string text = asText(name);
      if (std::find(aovNames.begin(), aovNames.end(), text) == aovNames.end())
        throw mismatch(name, "one of " + listed(aovNames));
      if (std::find(output.aov.begin(), output.aov.end(), text) != output.aov.end())
        throw mismatch(name, "each name once");
      output.aov.push_back(text);
    }
  return output;
}

CameraMotion asCamera(const Entry& entry) {
  const Section section(asTable(entry), entry.field,
                        {"position", "look_at", "up", "fov_deg", "from", "orbit"});
  const auto from = section.find("from"), orbit = section.find("orbit");
  if (from) {
    if (asTable(entry).size() > 1) throw mismatch(*from, "no other key beside it");
    return NamedCamera{asText(*from)};
  }
  const Track3 up = trackOr(section, "up", yUp);
  if (!orbit)
    return LookAtCamera{asTrack3(section.require("position")), asTrack3(section.require("look_at")), up,
                        asTrack(section.require("fov_deg"))};

  for (const std::string_view other : {"position", "look_at"})
    if (const auto extra = section.find(other)) throw mismatch(*extra, "no such key beside orbit");
  const Section path(asTable(*orbit), orbit->field, {"center", "radius", "azimuth_deg", "elevation_deg"});
  return OrbitCamera{trackOr(path, "center", origin),   up,
                     asTrack(path.require("radius")),   asTrack(path.require("azimuth_deg")),
                     trackOr(path, "elevation_deg", 0), asTrack(section.require("fov_deg"))};
}

// A choice by `type`: what each one is called, which other keys it has, how it is read.
template <class Value> struct Kind {
  std::string_view type;
  Keys keys;
  Value (*read)(const Section&);
};

template <class Value> Value asKind(const Entry& entry, const std::vector<Kind<Value>>& kinds) {
  const toml::table& table = asTable(entry);
  Keys types;
  for (const auto& kind : kinds) types.push_back(kind.type);

  const toml::node* type = table.get("type");
  if (!type) throw Error::mismatch("type = one of " + listed(types), "no type").at(entry.field);
  const Entry typeEntry{*type, entry.field + ".type"};
  const auto name = type->value<std::string_view>();
  for (const auto& kind : kinds) {
    if (name != kind.type) continue;
    Keys known = kind.keys;
    known.push_back("type");
    return kind.read(Section(table, entry.field, known));
  }
  throw mismatch(typeEntry, "one of " + listed(types));
}

const std::vector<Kind<LightMotion>>& lightKinds() {
  static const std::vector<Kind<LightMotion>> kinds = {
      {"directional",
       {"direction", "color", "intensity"},
       [](const Section& s) -> LightMotion {
         return DirectionalLightMotion{asTrack3(s.require("direction")), trackOr(s, "color", white),
                                       trackOr(s, "intensity", 1)};
       }},
      {"point",
       {"position", "color", "intensity"},
       [](const Section& s) -> LightMotion {
         return PointLightMotion{asTrack3(s.require("position")), trackOr(s, "color", white),
                                 trackOr(s, "intensity", 1)};
       }},
  };
  return kinds;
}

Expression asFormula(const Entry& entry) {
  return at(entry, [&] { return Expression(asText(entry), warpVariables); });
}

const std::vector<Kind<WarpMotion>>& warpKinds() {
  static const std::vector<Kind<WarpMotion>> kinds = {
      {"rigid",
       {"axis", "angle_deg", "center", "translate"},
       [](const Section& s) -> WarpMotion {
         return RigidMotion{trackOr(s, "axis", yUp), trackOr(s, "center", origin), trackOr(s, "angle_deg", 0),
                            trackOr(s, "translate", origin)};
       }},
      {"scale",
       {"factor", "center"},
       [](const Section& s) -> WarpMotion {
         return ScaleMotion{asTrack3(s.require("factor")), trackOr(s, "center", origin)};
       }},
      {"twist",
       {"axis", "center", "angle_deg", "length"},
       [](const Section& s) -> WarpMotion {
         return TwistMotion{asTrack3(s.require("axis")), trackOr(s, "center", origin),
                            asTrack(s.require("angle_deg")), trackOr(s, "length", 1)};
       }},
      {"bend",
       {"axis", "direction", "center", "angle_deg", "length"},
       [](const Section& s) -> WarpMotion {
         return BendMotion{asTrack3(s.require("axis")), asTrack3(s.require("direction")),
                           trackOr(s, "center", origin), asTrack(s.require("angle_deg")),
                           trackOr(s, "length", 1)};
       }},
      {"sine",
       {"axis", "direction", "center", "amplitude", "wavelength", "phase_deg"},
       [](const Section& s) -> WarpMotion {
         return SineMotion{asTrack3(s.require("axis")),      asTrack3(s.require("direction")),
                           trackOr(s, "center", origin),     asTrack(s.require("amplitude")),
                           asTrack(s.require("wavelength")), trackOr(s, "phase_deg", 0)};
       }},
      {"expression",
       {"x", "y", "z"},
       [](const Section& s) -> WarpMotion {
         return ExpressionMotion{asFormula(s.require("x")), asFormula(s.require("y")),
                                 asFormula(s.require("z"))};
       }},
  };
  return kinds;
}

template <class Value>
std::vector<Value> asList(const std::optional<Entry>& entry, const std::vector<Kind<Value>>& kinds) {
  std::vector<Value> values;
  if (!entry) return values;
  for (const Entry& element : asArray(*entry, "tables under [[" + entry->field + "]]"))
    values.push_back(asKind(element, kinds));
  return values;
}

Script asScript(const toml::table& table, const std::filesystem::path& folder) {
  const Section section(table, "", {"model", "frames", "output", "camera", "light", "warp"});
  Script script;
  if (const auto model = section.find("model")) script.model = folder / asText(*model);
  if (const auto frames = section.find("frames")) script.frames = asFrames(*frames);
  if (const auto output = section.find("output")) script.output = asOutput(*output);
  if (const auto camera = section.find("camera")) script.camera = asCamera(*camera);
  script.lights = asList(section.find("light"), lightKinds());
  script.warps = asList(section.find("warp"), warpKinds());
  return script;
}

} // namespace

Script parseScript(std::string_view text, const std::filesystem::path& path) {
  try {
    const toml::table table = toml::parse(text);
    Script script = asScript(table, path.parent_path());
    script.path = path;
    script.hash = contentHash(std::as_bytes(std::span(text)));
    return script;
  } catch (const toml::parse_error& error) {
    const auto where = error.source().begin;
    throw Error("line " + std::to_string(where.line) + ", column " + std::to_string(where.column) +
                ": not TOML: " + shown(error.description(), 200))
        .in(path);
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

Script readScript(const std::filesystem::path& path) {
  constexpr size_t most = size_t{1} << 24;
  std::error_code ignored; // reading tells what is wrong
  const auto size = std::filesystem::file_size(path, ignored);
  if (!ignored && size > most)
    throw Error::mismatch("a script of at most 16 MiB", std::to_string(size) + " bytes").in(path);
  return parseScript(readFile(path), path);
}

void requireShot(const Script& script) {
  const auto require = [&](bool given, const char* field) {
    if (!given)
      throw Error("missing; a shot needs model, frames, output and camera").at(field).in(script.path);
  };
  require(!script.model.empty(), "model");
  require(script.frames.has_value(), "frames");
  require(script.output.has_value(), "output");
  require(script.camera.has_value(), "camera");
}

} // namespace surflect
