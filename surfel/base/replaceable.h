// Protection of special files against being overwritten.
#pragma once

#include "surfel/base/error.h"

#include <filesystem>
#include <system_error>

namespace surflect {

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

} // namespace surflect
