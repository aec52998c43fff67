// What may be written over.
#pragma once

#include "surfel/base/error.h"

#include <filesystem>
#include <system_error>

namespace surflect {

// Only regular files are replaced: throws Error where the path is that of a folder, a pipe or a device. A
// link is what it leads to.
inline void requireReplaceable(const std::filesystem::path& path) {
  std::error_code unknown; // writing will say so
  const auto status = std::filesystem::status(path, unknown);
  if (!std::filesystem::exists(status) || std::filesystem::is_regular_file(status)) return;
  throw Error(std::filesystem::is_directory(status)
                  ? "cannot write (a folder is there)"
                  : "cannot write (something else than a regular file is there)")
      .in(path);
}

} // namespace surflect
