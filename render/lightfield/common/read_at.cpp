#include "render/lightfield/common/read_at.h"

#include "surfel/base/error.h"

#include <cerrno>
#include <cstring>
#include <string>
#include <unistd.h>

namespace surflect::lightfield {

void readAt(int descriptor, std::span<std::byte> bytes, uint64_t position) {
  while (!bytes.empty()) {
    const ssize_t count = ::pread(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(position));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw Error(std::string("cannot be read (") + std::strerror(errno) + ')');
    if (count == 0) throw Error("has become shorter");
    bytes = bytes.subspan(static_cast<size_t>(count));
    position += static_cast<uint64_t>(count);
  }
}

} // namespace surflect::lightfield
