// Folders on disk.
#pragma once

#include "surfel/base/error.h"

#include <filesystem>
#include <system_error>

namespace surflect {

// With those that it lies in; it may be there already. Throws Error.
inline void createFolder(const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw Error("cannot be created (" + failure.message() + ")").in(folder);
}

// Throws Error unless the folder is there and can be written to, or can be made where it is not. Makes
// nothing.
void requireCreatable(const std::filesystem::path& folder);

// With all that lies in it; it may be gone already. Throws Error.
inline void removeFolder(const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::remove_all(folder, failure);
  if (failure) throw Error("cannot be removed (" + failure.message() + ")").in(folder);
}

} // namespace surflect
