#include "surfel/base/open_file.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace surflect {

namespace {

Error readError(const std::filesystem::path& path) {
  return Error(std::string("cannot read (") + std::strerror(errno) + ")").in(path);
}

} // namespace

OpenFile::OpenFile(std::filesystem::path path) : path_(std::move(path)), descriptor_(openForReading(path_)) {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) {
    const Error error = readError(path_);
    ::close(descriptor_);
    throw error;
  }
  bytes_ = static_cast<uint64_t>(status.st_size);
}

OpenFile::~OpenFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

OpenFile::OpenFile(OpenFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)), bytes_(other.bytes_) {
}

void OpenFile::read(uint64_t position, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(position));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw readError(path_);
    if (count == 0) throw Error("has become shorter").in(path_);
    bytes = bytes.subspan(static_cast<size_t>(count));
    position += static_cast<uint64_t>(count);
  }
}

void OpenFile::adviseRead(uint64_t position, uint64_t bytes) const {
  // Only a hint: if it fails, reading is merely slower.
  ::posix_fadvise(descriptor_, static_cast<off_t>(position), static_cast<off_t>(bytes), POSIX_FADV_WILLNEED);
}

} // namespace surflect
