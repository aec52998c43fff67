// Folders on disk.
#pragma once

#include "surfel/base/error.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>

namespace surflect {

// Creates a folder and its parents; it may exist already. Throws Error.
inline void createFolder(const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw Error("cannot be created (" + failure.message() + ")").in(folder);
}

// Last part of the folder's absolute path, for "vase/" and "." too: "vase".
std::string folderName(const std::filesystem::path& folder);

// Bytes of all regular files in a folder and its folders; what cannot be read does not count.
uint64_t bytesIn(const std::filesystem::path& folder);

// Throws Error unless the folder is writable, or does not exist and can be created. Creates nothing.
void requireCreatable(const std::filesystem::path& folder);

// Removes a folder with its contents; it may be missing. Throws Error.
inline void removeFolder(const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::remove_all(folder, failure);
  if (failure) throw Error("cannot be removed (" + failure.message() + ")").in(folder);
}

} // namespace surflect
