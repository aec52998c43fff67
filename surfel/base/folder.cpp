#include "surfel/base/folder.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <cerrno>
#include <cstring>
#include <unistd.h>

namespace surflect {

std::string folderName(const std::filesystem::path& folder) {
  std::error_code unknown; // then the path remains
  const auto absolute = std::filesystem::absolute(folder / "", unknown);
  return (unknown ? folder / "" : absolute).lexically_normal().parent_path().filename().string();
}

uint64_t bytesIn(const std::filesystem::path& folder) {
  uint64_t bytes = 0;
  std::error_code failure;
  auto entry = std::filesystem::recursive_directory_iterator(
      folder, std::filesystem::directory_options::skip_permission_denied, failure);
  for (; !failure && entry != std::filesystem::recursive_directory_iterator(); entry.increment(failure))
    if (std::error_code unknown; entry->is_regular_file(unknown)) {
      const uint64_t size = entry->file_size(unknown);
      if (!unknown) bytes += size;
    }
  return bytes;
}

namespace {

// The folder, or the nearest one above it that exists.
std::filesystem::path nearestFolder(const std::filesystem::path& folder) {
  std::error_code unknown; // reported by those who use it
  auto nearest = std::filesystem::absolute(folder, unknown);
  while (!std::filesystem::exists(nearest, unknown) && nearest.has_relative_path())
    nearest = nearest.parent_path();
  return nearest;
}

} // namespace

std::optional<uint64_t> freeBytes(const std::filesystem::path& folder) {
  std::error_code failure;
  const std::filesystem::space_info disk = std::filesystem::space(nearestFolder(folder), failure);
  return failure ? std::nullopt : std::optional<uint64_t>(disk.available);
}

void requireCreatable(const std::filesystem::path& folder) {
  std::error_code unknown; // reported when creating
  const std::filesystem::path nearest = nearestFolder(folder);
  if (!std::filesystem::is_directory(nearest, unknown))
    throw Error("cannot be created (" + nearest.string() + " is not a folder)").in(folder);
  if (::access(nearest.c_str(), W_OK | X_OK) != 0)
    throw Error("cannot write into " + nearest.string() + " (" + std::strerror(errno) + ")").in(folder);
}

namespace fs = std::filesystem;

void requireResumable(const fs::path& folder, const FolderIdentity& identity) {
  const fs::path path = folder / identity.file;
  if (fs::exists(path)) {
    if (readFile(path, 1 << 16) != identity.text)
      throw Error(identity.problem + ": give the output a folder of its own").in(folder);
    return;
  }
  removeAbandoned(folder, [&](const std::string& name) { return name == identity.file; });
  if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
    throw Error::mismatch("a new folder, or an empty one", "something there already").in(folder);
}

void claimFolder(const fs::path& folder, const FolderIdentity& identity) {
  createFolder(folder);
  if (!fs::exists(folder / identity.file)) writeFileAtomically(folder / identity.file, identity.text);
  createFolder(folder / "images");
  removeAbandoned(folder, [](const std::string&) { return true; });
  removeAbandoned(folder / "images", [](const std::string&) { return true; });
}

} // namespace surflect
