#include "surfel/base/file.h"

#include "surfel/base/error.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>

namespace surflect {

namespace {

constexpr std::string_view kTemporaryEnd = ".tmp";

// "; did you mean examples/vase.srf?" for a path of which a part is missing; empty if no name beside that
// part is near.
std::string nearestFile(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  constexpr size_t kMostNames = 10000;
  std::error_code unknown;
  fs::path missing = path.has_filename() ? path : path.parent_path();
  while (missing.has_parent_path() && !fs::exists(missing.parent_path(), unknown))
    missing = missing.parent_path();
  const fs::path folder = missing.parent_path();
  const std::string name = missing.filename().string();
  if (name.empty()) return "";
  std::vector<std::string> beside;
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, unknown), end;
       !unknown && entry != end && beside.size() < kMostNames; entry.increment(unknown))
    if (std::string other = entry->path().filename().string();
        other != name && (other.front() != '.' || name.front() == '.')) // a link may lead nowhere
      beside.push_back(std::move(other));
  const std::vector<std::string_view> known(beside.begin(), beside.end());
  return didYouMean(name, known, folder.empty() ? "" : (folder / "").string());
}

Error systemError(const std::filesystem::path& path, std::string_view action) {
  const int number = errno;
  const std::string problem = "cannot " + std::string(action) + " (" + std::strerror(number) + ")";
  return Error(problem + (number == ENOENT ? nearestFile(path) : "")).in(path);
}

void syncFolder(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return; // some file systems cannot open folders; the rename is valid anyway
  ::fsync(descriptor);
  ::close(descriptor);
}

} // namespace

void requireExisting(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw systemError(path, "open");
}

int openForReading(const std::filesystem::path& path) {
  // Non-blocking: opening a pipe without writer would block.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) throw systemError(path, "open");
  struct stat status {};
  const bool known = ::fstat(descriptor, &status) == 0;
  if (known && S_ISREG(status.st_mode)) return descriptor;
  const Error error =
      known ? Error(S_ISDIR(status.st_mode) ? "cannot read (a folder)" : "cannot read (not a regular file)")
                  .in(path)
            : systemError(path, "read");
  ::close(descriptor);
  throw error;
}

namespace {

struct Descriptor {
  int number;

  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

// Reads as many bytes as available, up to the buffer's size; 0 at the end.
size_t readSome(int descriptor, std::span<char> buffer, const std::filesystem::path& path) {
  for (;;) {
    const ssize_t got = ::read(descriptor, buffer.data(), buffer.size());
    if (got >= 0) return static_cast<size_t>(got);
    if (errno != EINTR) throw systemError(path, "read");
  }
}

void writeAll(int descriptor, std::span<const std::byte> bytes, const std::filesystem::path& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw systemError(path, "write");
    bytes = bytes.subspan(static_cast<size_t>(count));
  }
}

constexpr size_t kPortion = 1 << 16; // bytes between two checkpoints

// At most `count` bytes of a file, which probably has `expected`.
std::string readUpTo(const std::filesystem::path& path, uint64_t count, uint64_t expected,
                     const Progress& progress) {
  const Descriptor file{openForReading(path)};
  try {
    std::string content;
    content.reserve(std::min(count, expected));
    char buffer[kPortion];
    while (content.size() < count) {
      progress.checkpoint();
      const size_t most = static_cast<size_t>(std::min<uint64_t>(kPortion, count - content.size()));
      const size_t got = readSome(file.number, {buffer, most}, path);
      if (got == 0) break;
      content.append(buffer, got);
    }
    return content;
  } catch (const std::bad_alloc&) {
    throw Error("does not fit into memory").in(path);
  }
}

} // namespace

std::string readFile(const std::filesystem::path& path, uint64_t most, const Progress& progress) {
  std::error_code ignored; // reported when reading
  const auto size = std::filesystem::file_size(path, ignored);
  std::string content;
  if (ignored || size <= most) content = readUpTo(path, most + 1, ignored ? 0 : size, progress);
  if ((!ignored && size > most) || content.size() > most)
    throw Error::mismatch("at most " + std::to_string(most) + " bytes", "more").in(path);
  return content;
}

std::string readFileStart(const std::filesystem::path& path, size_t count) {
  return readUpTo(path, count, 0, {});
}

// Not std::filesystem::copy_file, which reports a full disk as "Input/output error" and cannot be
// interrupted.
void copyFile(const std::filesystem::path& source, const std::filesystem::path& target,
              const Progress& progress) {
  const Descriptor from{openForReading(source)};
  Descriptor to{::open(target.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644)};
  if (to.number < 0) throw systemError(target, "write");
  char buffer[kPortion];
  while (const size_t got = readSome(from.number, buffer, source)) {
    progress.checkpoint();
    writeAll(to.number, std::as_bytes(std::span(buffer, got)), target);
  }
  ::fchmod(to.number, 0644); // for any umask, like AtomicFile
  if (::close(std::exchange(to.number, -1)) != 0) throw systemError(target, "write");
}

// The process holds a lock on a temporary during its lifetime; the system releases it with the process
// (removeAbandoned).
AtomicFile::AtomicFile(std::filesystem::path target) : target_(std::move(target)) {
  requireReplaceable(target_);
  for (;;) {
    std::string name = target_.string() + ".XXXXXX" + std::string(kTemporaryEnd);
    descriptor_ = ::mkostemps(name.data(), static_cast<int>(kTemporaryEnd.size()), O_CLOEXEC);
    if (descriptor_ < 0) throw systemError(target_, "write");
    temporary_ = name;
    ::flock(descriptor_, LOCK_EX); // without file locks, no temporary counts as abandoned
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0 || status.st_nlink > 0) return;
    ::close(descriptor_); // removed as abandoned before it was locked
  }
}

AtomicFile::~AtomicFile() {
  if (!committed_) ::unlink(temporary_.c_str());
  ::close(descriptor_);
}

void AtomicFile::write(std::span<const std::byte> bytes) { writeAll(descriptor_, bytes, target_); }

void AtomicFile::sync() {
  ::fchmod(descriptor_, 0644);
  if (::fsync(descriptor_) != 0) throw systemError(target_, "write");
}

void AtomicFile::rename() {
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) throw systemError(target_, "rename to");
  committed_ = true;
}

void AtomicFile::commit() {
  sync();
  rename();
  syncFolder(target_.parent_path());
}

void AtomicFile::commit(std::span<const std::unique_ptr<AtomicFile>> files) {
  for (const auto& file : files) file->sync();
  std::set<std::filesystem::path> folders;
  for (const auto& file : files) {
    file->rename();
    folders.insert(file->target_.parent_path());
  }
  for (const auto& folder : folders) syncFolder(folder);
}

void writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

void writeFileAtomically(const std::filesystem::path& path, std::string_view text) {
  writeFileAtomically(path, std::as_bytes(std::span(text)));
}

namespace {

// Target of a temporary, by its name: "frame.0001.exr.k3ZxQ1.tmp".
std::optional<std::string> targetOf(const std::string& name) {
  constexpr size_t kRandom = 7; // ".k3ZxQ1"
  if (!name.ends_with(kTemporaryEnd) || name.size() <= kRandom + kTemporaryEnd.size()) return std::nullopt;
  const size_t end = name.size() - kTemporaryEnd.size() - kRandom;
  const auto isRandom = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
  if (name[end] != '.' || !std::all_of(&name[end + 1], &name[end + kRandom], isRandom)) return std::nullopt;
  return name.substr(0, end);
}

void removeUnlessHeld(const std::filesystem::path& temporary) {
  const int descriptor = ::open(temporary.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
  if (descriptor < 0) return;
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) ::unlink(temporary.c_str());
  ::close(descriptor);
}

} // namespace

void removeAbandoned(const std::filesystem::path& folder,
                     const std::function<bool(const std::string& targetName)>& owned) {
  std::error_code failure; // nothing to report: files that cannot be removed stay
  for (std::filesystem::directory_iterator entry(folder, failure), end; !failure && entry != end;
       entry.increment(failure))
    if (const auto target = targetOf(entry->path().filename().string()); target && owned(*target))
      removeUnlessHeld(entry->path());
}

namespace {

Error readError(const std::filesystem::path& path) {
  return Error(std::string("cannot read (") + std::strerror(errno) + ")").in(path);
}

int64_t changeTime(const struct stat& status) {
  return int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec;
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
  changed_ = changeTime(status);
}

OpenFile::~OpenFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

OpenFile::OpenFile(OpenFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)), bytes_(other.bytes_),
      changed_(other.changed_) {}

void OpenFile::read(uint64_t position, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(position));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw readError(path_);
    if (count == 0) throw Error("has become shorter").in(path_);
    bytes = bytes.subspan(static_cast<size_t>(count));
    position += static_cast<uint64_t>(count);
  }
  // Afterwards: what was read before a change is what was checked.
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) throw readError(path_);
  if (changeTime(status) != changed_) throw Error("has been written to since it was opened").in(path_);
}

void OpenFile::adviseRead(uint64_t position, uint64_t bytes) const {
  // Only a hint: if it fails, reading is merely slower.
  ::posix_fadvise(descriptor_, static_cast<off_t>(position), static_cast<off_t>(bytes), POSIX_FADV_WILLNEED);
}

} // namespace surflect

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace surflect {

uint64_t contentHash(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }
uint64_t contentHash(std::string_view text) { return contentHash(std::as_bytes(std::span(text))); }

std::string hex(uint64_t hash) {
  std::string digits(16, '0');
  for (size_t i = 16; i-- > 0; hash >>= 4) digits[i] = "0123456789abcdef"[hash & 15];
  return digits;
}

} // namespace surflect
