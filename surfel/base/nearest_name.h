// For complaints about misspelt names: the known one that was probably meant.
#pragma once

#include <span>
#include <string_view>

namespace surflect {

// Levenshtein's distance: letters to insert, delete or replace.
size_t editDistance(std::string_view a, std::string_view b);

// The known name of smallest distance, the first of equals; `known` is not empty.
std::string_view nearestName(std::string_view name, std::span<const std::string_view> known);

} // namespace surflect
