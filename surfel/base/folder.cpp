#include "surfel/base/folder.h"

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

void requireCreatable(const std::filesystem::path& folder) {
  std::error_code unknown; // reported when creating
  auto nearest = std::filesystem::absolute(folder, unknown);
  while (!std::filesystem::exists(nearest, unknown) && nearest.has_relative_path())
    nearest = nearest.parent_path();
  if (!std::filesystem::is_directory(nearest, unknown))
    throw Error("cannot be created (" + nearest.string() + " is not a folder)").in(folder);
  if (::access(nearest.c_str(), W_OK | X_OK) != 0)
    throw Error("cannot write into " + nearest.string() + " (" + std::strerror(errno) + ")").in(folder);
}

} // namespace surflect
