// Suggestion of the known name nearest to a misspelt one.
#pragma once

#include <span>
#include <string_view>

namespace surflect {

// Levenshtein distance: number of letters to insert, delete or replace.
size_t editDistance(std::string_view a, std::string_view b);

// Known name that begins with the name, if it has three letters or more; else the one of smallest distance,
// the first of equals. `known` is not empty.
std::string_view nearestName(std::string_view name, std::span<const std::string_view> known);

} // namespace surflect
