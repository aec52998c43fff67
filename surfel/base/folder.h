// Folders on disk.
#pragma once

#include "surfel/base/error.h"

#include <cstdint>
#include <filesystem>
#include <optional>
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

// Free bytes of the disk that a folder is on, or would be on: it may be missing. Empty if it cannot be told.
std::optional<uint64_t> freeBytes(const std::filesystem::path& folder);

// Throws Error unless the folder is writable, or does not exist and can be created. Creates nothing.
void requireCreatable(const std::filesystem::path& folder);

// Removes a folder with its contents; it may be missing. Throws Error.
inline void removeFolder(const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::remove_all(folder, failure);
  if (failure) throw Error("cannot be removed (" + failure.message() + ")").in(folder);
}

// Protection of special files against being overwritten.

// Throws Error unless the path is free or a regular file: folders, pipes and devices are not replaced. Links
// are followed.
inline void requireReplaceable(const std::filesystem::path& path) {
  std::error_code unknown; // reported when writing
  const auto status = std::filesystem::status(path, unknown);
  if (!std::filesystem::exists(status) || std::filesystem::is_regular_file(status)) return;
  throw Error(std::filesystem::is_directory(status)
                  ? "cannot write (a folder is there)"
                  : "cannot write (something else than a regular file is there)")
      .in(path);
}

// Output folder that is filled over a long time and resumed after an interruption. A file in it states what
// it is the output of.
struct FolderIdentity {
  std::string file;    // name of the stating file, such as "stage.identity"
  std::string text;    // equal for equal input
  std::string problem; // of a folder with another text: "is of another stage file"
};

// Throws Error if the folder holds anything but output of this identity. It may be missing or empty.
void requireResumable(const std::filesystem::path& folder, const FolderIdentity& identity);

// Creates the folder and its folder `images` and states the identity. Removes temporaries of killed runs.
// Call requireResumable() first. Throws Error.
void claimFolder(const std::filesystem::path& folder, const FolderIdentity& identity);

} // namespace surflect
