#include "render/scene/script_edit.h"

#include "render/scene/script_fields.h"
#include "surfel/base/error.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>
#include <vector>

namespace surflect::scene {

namespace {

using Json = nlohmann::json;

constexpr const char* kPlace = "#"; // key of a table's place in the text

std::string fieldOf(const std::string& table, const std::string& key) {
  return table.empty() ? key : table + '.' + key;
}

// --- TOML to JSON

Json jsonOf(const toml::node& node) {
  if (const auto* string = node.as_string()) return string->get();
  if (const auto* integer = node.as_integer()) return integer->get();
  if (const auto* boolean = node.as_boolean()) return boolean->get();
  if (const auto* real = node.as_floating_point()) {
    if (std::isfinite(real->get())) return real->get();
    return fmt::format("{}", real->get()); // no number of a script; its reader refuses the text
  }
  if (const auto* array = node.as_array()) {
    Json elements = Json::array();
    for (const toml::node& element : *array) elements.push_back(jsonOf(element));
    return elements;
  }
  if (const auto* table = node.as_table()) {
    Json object = Json::object();
    for (auto&& [key, value] : *table) object[std::string(key.str())] = jsonOf(value);
    return object;
  }
  std::ostringstream date;
  node.visit([&](const auto& value) {
    if constexpr (toml::is_value<decltype(value)>) date << value.get();
  });
  return date.str();
}

bool hasPlaces(const std::string& key) { return key == "light" || key == "warp"; }

Json valuesOf(const toml::table& table) {
  Json values = jsonOf(table);
  for (auto& [key, list] : values.items()) {
    if (!hasPlaces(key) || !list.is_array()) continue;
    for (size_t place = 0; place < list.size(); ++place)
      if (list[place].is_object()) list[place][kPlace] = place;
  }
  return values;
}

// --- JSON to TOML

std::string quoted(const std::string& text) {
  std::string literal = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      literal += {'\\', c};
    else if (byte < 0x20 || byte == 0x7f)
      literal += fmt::format("\\u{:04X}", byte);
    else
      literal += c;
  }
  return literal + '"';
}

std::string keyText(const std::string& key) {
  const bool isBare = !key.empty() && std::ranges::all_of(key, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
  return isBare ? key : quoted(key);
}

std::string literalOf(const Json& value, const std::string& field) {
  if (value.is_string()) return quoted(value.get<std::string>());
  if (value.is_boolean()) return value.get<bool>() ? "true" : "false";
  if (value.is_number_integer()) return value.dump();
  if (value.is_number_float()) {
    const double number = value.get<double>();
    return number == 0 && std::signbit(number) ? "-0.0" : fmt::format("{}", number); // reads as the same bits
  }
  std::string literal;
  if (value.is_array()) {
    for (size_t i = 0; i < value.size(); ++i)
      literal += (i > 0 ? ", " : "") + literalOf(value[i], fmt::format("{}[{}]", field, i));
    return '[' + literal + ']';
  }
  if (value.is_object()) {
    for (const auto& [key, element] : value.items())
      literal +=
          (literal.empty() ? " " : ", ") + keyText(key) + " = " + literalOf(element, fieldOf(field, key));
    return literal.empty() ? "{}" : '{' + literal + " }";
  }
  throw Error::mismatch("a number, a string, true or false, an array or an object", "null").at(field);
}

// Parses JSON that is no deeper than a script can be: what walks through it does so by recursion.
Json parsedJson(std::string_view text) {
  try {
    return Json::parse(text, [](int depth, Json::parse_event_t, Json&) {
      if (depth > kDeepestToml)
        throw Error::mismatch(fmt::format("at most {}", kDeepestToml), "more JSON values in one another");
      return true;
    });
  } catch (const Json::exception& error) {
    throw Error(fmt::format("not JSON: {}", error.what()));
  }
}

// Values without places, and without empty lists of lights and warps: what a text can be compared with.
Json plain(Json values) {
  for (const char* const key : {"light", "warp"})
    if (values.contains(key) && values[key].is_array() && values[key].empty()) values.erase(key);
  for (auto& [key, list] : values.items())
    if (hasPlaces(key) && list.is_array())
      for (Json& element : list)
        if (element.is_object()) element.erase(kPlace);
  return values;
}

// --- Text of a script

// A part of the text and what replaces it.
struct Splice {
  size_t begin, end; // bytes
  std::string text;
};

// Byte offsets of the lines and columns by which toml++ counts: columns are code points, both start at 1.
class Positions {
public:
  explicit Positions(std::string_view text) : text_(text), lines_{0} {
    for (size_t i = 0; i < text.size(); ++i)
      if (text[i] == '\n') lines_.push_back(i + 1);
  }
  // Where a line begins; the end of the text for a line after the last one.
  size_t line(size_t number) const { return number <= lines_.size() ? lines_[number - 1] : text_.size(); }
  size_t offset(const toml::source_position& position) const {
    size_t at = line(position.line);
    for (size_t column = 1; column < position.column && at < text_.size(); ++column) do
        ++at;
      while (at < text_.size() && (static_cast<unsigned char>(text_[at]) & 0xc0) == 0x80);
    return at;
  }

private:
  std::string_view text_;
  std::vector<size_t> lines_;
};

// Finds the splices by which a script's text gets other values.
class Editor {
public:
  Editor(std::string_view text, const toml::table& root) : text_(text), positions_(text), root_(root) {
    findHeaders(root);
  }

  std::string edited(const Json& values) {
    editTable(root_, values, "");
    std::ranges::stable_sort(splices_, [](const Splice& a, const Splice& b) {
      return std::pair(a.begin, a.end) < std::pair(b.begin, b.end);
    });
    std::string text(text_);
    for (auto splice = splices_.rbegin(); splice != splices_.rend(); ++splice)
      text.replace(splice->begin, splice->end - splice->begin, splice->text);
    if (!appended_.empty() && !text.empty() && text.back() != '\n') text += '\n';
    return text + appended_;
  }

private:
  enum class Form { root, header, dotted }; // of a table that is not inline

  // Whether a table is written as [name] or [[name]] on a line of its own.
  bool isHeader(const toml::table& table) const {
    if (table.is_inline() || &table == &root_) return false;
    const size_t at = positions_.offset(table.source().begin);
    return at < text_.size() && text_[at] == '[';
  }
  Form formOf(const toml::table& table) const {
    if (&table == &root_) return Form::root;
    return isHeader(table) ? Form::header : Form::dotted;
  }

  void findHeaders(const toml::node& node) {
    if (const auto* table = node.as_table()) {
      if (isHeader(*table)) headers_.insert(table->source().begin.line);
      for (auto&& [key, value] : *table) findHeaders(value);
    } else if (const auto* array = node.as_array()) {
      for (const toml::node& element : *array) findHeaders(element);
    }
  }

  void editTable(const toml::table& table, const Json& values, const std::string& field) {
    for (auto&& [key, node] : table) {
      const std::string name(key.str());
      const auto wanted = values.find(name);
      if (wanted == values.end())
        remove(key, node);
      else if (&table == &root_ && hasPlaces(name))
        editList(name, node, *wanted);
      else
        edit(node, *wanted, fieldOf(field, name));
    }
    for (const auto& [name, value] : values.items()) {
      if (table.contains(name)) continue;
      if (&table == &root_ && hasPlaces(name) && value.is_array()) {
        for (const Json& element : value) appended_ += '\n' + newTable(name, element);
      } else {
        insert(table, name, value, fieldOf(field, name));
      }
    }
  }

  static bool haveSameKeys(const toml::table& table, const Json& values) {
    return table.size() == values.size() && std::ranges::all_of(table, [&](const auto& entry) {
             return values.contains(std::string(entry.first.str()));
           });
  }

  void edit(const toml::node& node, const Json& wanted, const std::string& field) {
    if (jsonOf(node) == wanted) return;
    if (const auto* table = node.as_table(); table && wanted.is_object()) {
      if (!table->is_inline() || haveSameKeys(*table, wanted)) return editTable(*table, wanted, field);
    }
    const auto* array = node.as_array();
    if (array && wanted.is_array() && wanted.size() == array->size()) {
      for (size_t i = 0; i < array->size(); ++i)
        edit(*array->get(i), wanted[i], fmt::format("{}[{}]", field, i));
      return;
    }
    if ((array && isListOfHeaders(*array)) || (node.is_table() && !node.as_table()->is_inline()))
      throw Error("is written as tables, and cannot become another value").at(field);
    replace(node, literalOf(wanted, field));
  }

  bool isListOfHeaders(const toml::array& array) const {
    return !array.empty() && array.get(0)->is_table() && isHeader(*array.get(0)->as_table());
  }

  // [[light]] or [[warp]]: tables keep their places by "#".
  void editList(const std::string& name, const toml::node& node, const Json& wanted) {
    const auto* array = node.as_array();
    if (!array || !wanted.is_array() || !isListOfHeaders(*array)) {
      const Json values = plain({{name, wanted}});
      return edit(node, values.value(name, Json::array()), name);
    }
    std::vector<const Json*> kept(array->size(), nullptr);
    size_t next = 0; // places must rise: the order of tables is theirs in the text
    for (const Json& element : wanted) {
      const auto place = element.is_object() ? element.find(kPlace) : element.end();
      if (!element.is_object()) throw Error::mismatch("tables", element.type_name()).at(name);
      if (place == element.end()) continue;
      if (!place->is_number_unsigned() || place->get<size_t>() < next || place->get<size_t>() >= kept.size())
        throw Error::mismatch("rising places of the script's tables", place->dump()).at(name + ".#");
      next = place->get<size_t>() + 1;
      kept[next - 1] = &element;
    }
    const auto tableAt = [&](size_t place) -> const toml::table& { return *array->get(place)->as_table(); };
    for (size_t i = 0; i < kept.size(); ++i) {
      const toml::table& table = tableAt(i);
      if (!kept[i]) {
        removeHeader(table);
        continue;
      }
      Json values = *kept[i];
      values.erase(kPlace);
      editTable(table, values, fmt::format("{}[{}]", name, i));
    }
    std::string fresh; // new tables, which come before the next one that is kept
    for (const Json& element : wanted) {
      if (!element.contains(kPlace)) {
        fresh += newTable(name, element) + '\n';
      } else if (!fresh.empty()) {
        const size_t at =
            positions_.line(withComments(tableAt(element[kPlace].get<size_t>()).source().begin.line));
        splices_.push_back({at, at, std::exchange(fresh, "")});
      }
    }
    if (!fresh.empty()) appended_ += '\n' + fresh.substr(0, fresh.size() - 1);
  }

  // "[[name]]" and its lines.
  static std::string newTable(const std::string& name, const Json& element) {
    if (!element.is_object()) throw Error::mismatch("tables", element.type_name()).at(name);
    if (element.contains(kPlace))
      throw Error::mismatch("none, as the script has no such table", element[kPlace].dump()).at(name + ".#");
    return fmt::format("[[{}]]\n", name) + statements(element, name);
  }

  // First of the comments right above a line, or the line itself.
  size_t withComments(size_t line) const {
    while (line > 1 && text_.substr(positions_.line(line - 1)).starts_with('#')) --line;
    return line;
  }

  // "key = value" lines of an object, its type first.
  static std::string statements(const Json& object, const std::string& field) {
    std::string type, others;
    for (const auto& [key, value] : object.items())
      (key == "type" ? type : others) += keyText(key) + " = " + literalOf(value, fieldOf(field, key)) + '\n';
    return type + others;
  }

  void replace(const toml::node& node, std::string literal) {
    splices_.push_back(
        {positions_.offset(node.source().begin), positions_.offset(node.source().end), std::move(literal)});
  }

  // Removes the lines of "key = value", with the comment after it.
  void removeLines(const toml::key& key, const toml::node& node) {
    splices_.push_back({positions_.line(key.source().begin.line), positions_.line(lastLine(node) + 1), ""});
  }
  static size_t lastLine(const toml::node& node) { return node.source().end.line; }

  void remove(const toml::key& key, const toml::node& node) {
    if (const auto* inner = node.as_table(); inner && !inner->is_inline()) {
      if (isHeader(*inner)) return removeHeader(*inner);
      for (auto&& [name, value] : *inner) remove(name, value);
      return;
    }
    if (const auto* array = node.as_array(); array && isListOfHeaders(*array)) {
      for (const toml::node& element : *array) removeHeader(*element.as_table());
      return;
    }
    removeLines(key, node);
  }

  // Removes a table's header and lines. Comments right above a header are that header's.
  void removeHeader(const toml::table& table) {
    for (auto&& [key, node] : table) {
      if (const auto* inner = node.as_table(); inner && isHeader(*inner)) removeHeader(*inner);
      if (const auto* array = node.as_array(); array && isListOfHeaders(*array))
        for (const toml::node& element : *array) removeHeader(*element.as_table());
    }
    const size_t line = table.source().begin.line;
    const auto next = headers_.upper_bound(line);
    const size_t end = next != headers_.end() ? std::max(line + 1, withComments(*next)) : SIZE_MAX;
    splices_.push_back({positions_.line(withComments(line)), positions_.line(end), ""});
  }

  // The last line with a value of a table itself, not of a table with a header of its own; 0 if there is
  // none.
  size_t lastStatement(const toml::table& table) const {
    size_t last = 0;
    for (auto&& [key, node] : table) {
      if (const auto* array = node.as_array(); array && isListOfHeaders(*array)) continue;
      const auto* inner = node.as_table();
      if (inner && !inner->is_inline())
        last = std::max(last, isHeader(*inner) ? 0 : lastStatement(*inner));
      else
        last = std::max(last, lastLine(node));
    }
    return last;
  }

  void insert(const toml::table& table, const std::string& key, const Json& value, const std::string& field) {
    const std::string statement = keyText(key) + " = " + literalOf(value, field);
    switch (formOf(table)) {
    case Form::root:
      if (value.is_object())
        appended_ += fmt::format("\n[{}]\n", keyText(key)) + statements(value, field);
      else
        insertLine(lastStatement(table) + 1, statement);
      return;
    case Form::header:
      insertLine(std::max(lastStatement(table), size_t{table.source().begin.line}) + 1, statement);
      return;
    case Form::dotted: // after a sibling, with the keys before its own
      for (auto&& [name, node] : table) {
        if (node.is_table()) continue;
        const size_t begin = positions_.line(name.source().begin.line);
        const std::string_view before = text_.substr(begin, positions_.offset(name.source().begin) - begin);
        return insertLine(lastLine(node) + 1, std::string(before) + statement);
      }
      throw Error("its table has no line where this value could stand").at(field);
    }
  }

  void insertLine(size_t line, const std::string& statement) {
    const size_t at = positions_.line(line);
    const bool isAfterText = at == text_.size() && !text_.empty() && text_.back() != '\n';
    splices_.push_back({at, at, (isAfterText ? "\n" : "") + statement + '\n'});
  }

  const std::string_view text_;
  const Positions positions_;
  const toml::table& root_;
  std::set<size_t> headers_; // lines
  std::vector<Splice> splices_;
  std::string appended_;
};

toml::table parsedToml(std::string_view text) {
  const ScriptDocument checked(text, {}); // its Errors name lines
  return toml::parse(text);
}

} // namespace

std::string scriptValues(std::string_view text, const std::filesystem::path& path) {
  return inFile(path, [&] { return valuesOf(parsedToml(text)).dump(); });
}

std::string withValues(std::string_view text, const std::filesystem::path& path, std::string_view values) {
  return inFile(path, [&] {
    const Json wanted = parsedJson(values);
    if (!wanted.is_object()) throw Error::mismatch("a JSON object", wanted.type_name());
    const toml::table table = parsedToml(text);
    std::string edited = Editor(text, table).edited(wanted);
    if (plain(jsonOf(parsedToml(edited))) != plain(wanted))
      throw Error("the layout of its text does not let these values be replaced");
    return edited;
  });
}

} // namespace surflect::scene
