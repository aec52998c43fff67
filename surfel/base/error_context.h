// Field and file that an Error of some work is given on its way up.
#pragma once

#include "surfel/base/error.h"

#include <filesystem>
#include <string_view>
#include <utility>

namespace surflect {

// Returns work(); its Errors get the outer field.
template <class Work> decltype(auto) atField(std::string_view field, const Work& work) {
  try {
    return work();
  } catch (Error& error) {
    throw std::move(error).at(field);
  }
}

// Returns work(); its Errors get the file.
template <class Work> decltype(auto) inFile(const std::filesystem::path& file, const Work& work) {
  try {
    return work();
  } catch (Error& error) {
    throw std::move(error).in(file);
  }
}

} // namespace surflect
