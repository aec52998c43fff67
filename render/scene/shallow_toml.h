// Check that TOML is not nested too deeply. The TOML library frees and copies tables by recursion, which
// would overflow the stack; its own limit counts nested values, but not the dots of keys.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace surflect::scene {

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

} // namespace surflect::scene
