#include "render/scene/script_fields.h"

#include "surfel/base/text.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>

namespace surflect::scene {

namespace {

const toml::node& nodeOf(const Entry& entry) { return *static_cast<const toml::node*>(entry.node); }

Entry entryOf(const toml::node& node, std::string field, const Entry& parent) {
  return {&node, std::move(field), parent.folder, parent.origin};
}

std::string fieldOf(const Entry& table, std::string_view key) {
  return table.field.empty() ? std::string(key) : table.field + '.' + std::string(key);
}

// Text of a script, fit for one line of a message: cut short, and without control characters.
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
  if (const auto* real = node.as_floating_point()) text = numberText(real->get());
  if (const auto* boolean = node.as_boolean()) text = boolean->get() ? "true" : "false";
  if (const auto* array = node.as_array()) text = "an array of " + std::to_string(array->size());
  if (node.is_table()) text = "a table";
  return text + " on line " + std::to_string(node.source().begin.line);
}

const toml::table& asTable(const Entry& entry) {
  if (const toml::table* table = nodeOf(entry).as_table()) return *table;
  throw mismatch(entry, "a table");
}

// Moved, not copied: copies forget the lines that they stood on.
void mergeInto(toml::table& target, toml::table& source) {
  for (auto&& [key, node] : source) {
    toml::node* const existing = target.get(key.str());
    if (existing && existing->is_table() && node.is_table())
      mergeInto(*existing->as_table(), *node.as_table());
    else
      node.visit([&, &name = key](auto& value) { target.insert_or_assign(name, std::move(value)); });
  }
}

warp::Keyframe asKeyframe(const Entry& entry) {
  constexpr std::string_view form = "a keyframe [frame, value] or [frame, value, \"smooth\"]";
  const std::vector<Entry> parts = asArray(entry, form);
  if (parts.size() < 2 || parts.size() > 3) throw mismatch(entry, form);
  if (parts.size() == 3 && nodeOf(parts[2]).value_or(std::string_view()) != "smooth")
    throw mismatch(parts[2], "\"smooth\"");
  return {asNumber(parts[0]), asNumber(parts[1]), parts.size() == 3};
}

} // namespace

struct ScriptDocument::Parsed {
  toml::table table;
  std::filesystem::path folder;
  Vec3<double> origin = {0, 0, 0};
};

ScriptDocument::ScriptDocument(std::string_view text, const std::filesystem::path& path) {
  if (const auto line = tooDeepLine(text, kDeepestToml))
    throw Error::mismatch("at most " + std::to_string(kDeepestToml), "more tables in one another")
        .at("line " + std::to_string(*line));
  try {
    parsed_ = std::make_unique<Parsed>(Parsed{toml::parse(text), path.parent_path(), {0, 0, 0}});
  } catch (const toml::parse_error& error) {
    const auto where = error.source().begin;
    throw Error("line " + std::to_string(where.line) + ", column " + std::to_string(where.column) +
                ": not TOML: " + shown(error.description(), 200));
  }
}

ScriptDocument::~ScriptDocument() = default;

Entry ScriptDocument::root() const { return {&parsed_->table, "", &parsed_->folder, &parsed_->origin}; }

void ScriptDocument::countFrom(const Vec3<double>& origin) { parsed_->origin = origin; }

void ScriptDocument::prefer(std::string_view group, std::string_view name) {
  toml::table* const groups = parsed_->table[group].as_table();
  toml::node* const named = groups ? groups->get(name) : nullptr;
  const std::string field = std::string(group) + "." + shown(name);
  if (!named) {
    Keys known;
    if (groups)
      for (auto&& [key, node] : *groups) known.push_back(key.str());
    throw Error("missing" + (known.empty() ? std::string() : ", expected " + listed(known)) +
                didYouMean(name, known))
        .at(field);
  }
  if (!named->is_table()) throw Error::mismatch("a table", shown(*named)).at(field);
  toml::table chosen = std::move(*named->as_table()); // what is put in may itself be called [group.name]
  mergeInto(parsed_->table, chosen);
}

Section::Section(const Entry& table, const Keys& known) : table_(table) {
  for (const auto& [key, node] : asTable(table)) {
    const std::string name = shown(key.str());
    if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
    const std::string meant = didYouMean(name, known);
    throw Error("unknown key on line " + std::to_string(key.source().begin.line) +
                (meant.empty() ? "; known are " + listed(known) : meant))
        .at(fieldOf(table, name));
  }
}

size_t Section::size() const { return asTable(table_).size(); }

std::optional<Entry> Section::find(std::string_view key) const {
  const toml::node* node = asTable(table_).get(key);
  if (!node) return std::nullopt;
  return entryOf(*node, fieldOf(table_, key), table_);
}

Entry Section::require(std::string_view key) const {
  if (const auto entry = find(key)) return *entry;
  throw Error("missing from the table on line " + std::to_string(nodeOf(table_).source().begin.line))
      .at(fieldOf(table_, key));
}

Error mismatch(const Entry& entry, std::string_view expected) {
  return Error::mismatch(expected, shown(nodeOf(entry))).at(entry.field);
}

Error noneOf(const Entry& entry, const Keys& names) {
  const auto* text = nodeOf(entry).as_string();
  return mismatch(entry, "one of " + listed(names) + (text ? didYouMean(text->get(), names) : ""));
}

bool isText(const Entry& entry) { return nodeOf(entry).is_string(); }

std::string asText(const Entry& entry) {
  const auto* text = nodeOf(entry).as_string();
  if (!text || text->get().empty()) throw mismatch(entry, "a string that is not empty");
  return text->get();
}

std::filesystem::path asPath(const Entry& entry) { return *entry.folder / asText(entry); }

double asNumber(const Entry& entry) {
  const auto number = nodeOf(entry).value<double>();
  if (!nodeOf(entry).is_number() || !number || !std::isfinite(*number))
    throw mismatch(entry, "a finite number");
  return *number;
}

double numberIn(const Entry& entry, double least, double most) {
  const double number = asNumber(entry);
  if (!(number >= least && number <= most)) throw mismatch(entry, fmt::format("{} to {}", least, most));
  return number;
}

Vec3<double> asVector(const Entry& entry) {
  const std::vector<Entry> parts = asArray(entry, "an array of 3 numbers");
  if (parts.size() != 3) throw mismatch(entry, "an array of 3 numbers");
  return {numberIn(parts[0], -1e9, 1e9), numberIn(parts[1], -1e9, 1e9), numberIn(parts[2], -1e9, 1e9)};
}

int asInteger(const Entry& entry, int least, int most) {
  const auto number = nodeOf(entry).value<double>(); // other programs write 48.0
  if (!nodeOf(entry).is_number() || !number || *number != std::floor(*number) || *number < least ||
      *number > most)
    throw mismatch(entry, "an integer in " + std::to_string(least) + ".." + std::to_string(most));
  return static_cast<int>(*number);
}

bool asBoolean(const Entry& entry) {
  if (const auto* boolean = nodeOf(entry).as_boolean()) return boolean->get();
  throw mismatch(entry, "true or false");
}

std::vector<Entry> asArray(const Entry& entry, std::string_view expected) {
  const toml::array* array = nodeOf(entry).as_array();
  if (!array) throw mismatch(entry, expected);
  std::vector<Entry> elements;
  for (size_t i = 0; i < array->size(); ++i)
    elements.push_back(entryOf(*array->get(i), entry.field + '[' + std::to_string(i) + ']', entry));
  return elements;
}

warp::Track asTrack(const Entry& entry) {
  if (nodeOf(entry).is_number()) return asNumber(entry);
  if (nodeOf(entry).is_string()) return at(entry, [&] { return warp::Track::expression(asText(entry)); });
  std::vector<warp::Keyframe> keys;
  for (const Entry& key : asArray(entry, "a number, a list of keyframes or an expression"))
    keys.push_back(asKeyframe(key));
  return at(entry, [&] { return warp::Track::keyframes(std::move(keys)); });
}

warp::Track3 asTrack3(const Entry& entry) {
  const std::vector<Entry> elements = asArray(entry, "an array of 3");
  if (elements.size() != 3) throw mismatch(entry, "an array of 3");
  return {asTrack(elements[0]), asTrack(elements[1]), asTrack(elements[2])};
}

warp::Track3 asPlace(const Entry& entry) {
  warp::Track3 place = asTrack3(entry);
  for (size_t axis = 0; axis < 3; ++axis)
    place[axis] = place[axis].plus(-(*entry.origin)[static_cast<Eigen::Index>(axis)]);
  return place;
}

warp::Track trackOr(const Section& section, std::string_view key, double otherwise) {
  const auto entry = section.find(key);
  return entry ? asTrack(*entry) : warp::Track(otherwise);
}

warp::Track3 trackOr(const Section& section, std::string_view key, const warp::Track3& otherwise) {
  const auto entry = section.find(key);
  return entry ? asTrack3(*entry) : otherwise;
}

warp::Track3 placeOrOrigin(const Section& section, std::string_view key) {
  if (const auto entry = section.find(key)) return asPlace(*entry);
  const Entry& table = section.table();
  if (!table.origin->isZero(0))
    throw Error::mismatch("three numbers, as coordinates are original", "nothing").at(fieldOf(table, key));
  return {0, 0, 0};
}

size_t typeOf(const Entry& table, const Keys& types) {
  const toml::node* type = asTable(table).get("type");
  if (!type) throw Error::mismatch("type = one of " + listed(types), "no type").at(table.field);
  const auto found = std::find(types.begin(), types.end(), type->value_or(std::string_view()));
  if (found == types.end()) throw noneOf(entryOf(*type, table.field + ".type", table), types);
  return static_cast<size_t>(found - types.begin());
}

} // namespace surflect::scene
