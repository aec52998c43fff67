#include "render/method/method.h"

#include "surfel/base/folder.h"

namespace surflect::method {

uint64_t modelBytes(const std::filesystem::path& folder) {
  const std::filesystem::path views = folder / kViewsFolder;
  return bytesIn(folder) - (std::filesystem::is_directory(views) ? bytesIn(views) : 0);
}

} // namespace surflect::method
