// Texts of files with parts replaced.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace surflect {

// Replaces the first occurrence of `from`, which must exist.
inline std::string replaced(std::string text, std::string_view from, std::string_view to) {
  const size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("there is no " + std::string(from));
  return text.replace(at, from.size(), to);
}

} // namespace surflect
