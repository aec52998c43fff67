#include "surfel/file.h"

#include "surfel/error.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace surflect {

namespace {

Error systemError(const std::filesystem::path& path, std::string_view action) {
  return Error("cannot " + std::string(action) + " (" + std::strerror(errno) + ")").in(path);
}

void syncFolder(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return; // some file systems do not open folders; the rename itself stands
  ::fsync(descriptor);
  ::close(descriptor);
}

} // namespace

std::string readFile(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw systemError(path, "open");
  std::string content;
  char buffer[1 << 16];
  for (;;) {
    const ssize_t count = ::read(descriptor, buffer, sizeof buffer);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const Error error = systemError(path, "read");
      ::close(descriptor);
      throw error;
    }
    if (count == 0) break;
    content.append(buffer, static_cast<size_t>(count));
  }
  ::close(descriptor);
  return content;
}

AtomicFile::AtomicFile(std::filesystem::path target)
    : target_(std::move(target)), temporary_(target_.string() + ".XXXXXX.tmp") {
  std::string name = temporary_.string();
  descriptor_ = ::mkostemps(name.data(), 4, O_CLOEXEC);
  if (descriptor_ < 0) throw systemError(target_, "write");
  temporary_ = name;
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!committed_) ::unlink(temporary_.c_str());
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw systemError(target_, "write");
    bytes = bytes.subspan(static_cast<size_t>(count));
  }
}

void AtomicFile::commit() {
  ::fchmod(descriptor_, 0644);
  // Reopened by path: a library may have replaced the file beside us instead of writing into it.
  const int written = ::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = written >= 0 && ::fsync(written) == 0;
  if (written >= 0) ::close(written);
  if (!synced) throw systemError(target_, "write");
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) throw systemError(target_, "rename to");
  committed_ = true;
  syncFolder(target_.parent_path());
}

void writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

void writeFileAtomically(const std::filesystem::path& path, std::string_view text) {
  writeFileAtomically(path, std::as_bytes(std::span(text)));
}

} // namespace surflect
