// Whole files: read at once, or written atomically, so that a reader sees the old file or the complete new
// one.
#pragma once

#include "surfel/base/time.h"

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace surflect {

// Size limits; a larger file is refused.
inline constexpr uint64_t kLargestText = uint64_t{1} << 28; // descriptions that people or exporters write
inline constexpr uint64_t kLargestFile = uint64_t{1} << 35;

// Throws Error unless there is a file or folder at the path: "cannot open (No such file or directory); did
// you mean examples/vase?", if a name there is near.
void requireExisting(const std::filesystem::path& path);

// Opens a file for reading; the caller closes the descriptor. Throws Error naming the file, also if it is not
// a regular file: a device is endless, and a pipe blocks.
int openForReading(const std::filesystem::path& path);

// Content of a file. Throws Error naming the file, also if it is not a regular file or larger than `most`
// bytes, and Cancelled.
std::string readFile(const std::filesystem::path& path, uint64_t most = kLargestFile,
                     const Progress& progress = {});
// First `count` bytes of a file, or all if it is shorter.
std::string readFileStart(const std::filesystem::path& path, size_t count);

// Copies a file into a new one, which is left incomplete if Error or Cancelled is thrown.
void copyFile(const std::filesystem::path& source, const std::filesystem::path& target,
              const Progress& progress = {});

// Writes beside the target; commit() syncs and renames, otherwise the destructor removes the temporary.
//
// Several files at once: all are synced before the first is renamed, so that after a crash every visible one
// is complete. They are renamed in order, and their folders synced once.
class AtomicFile {
public:
  explicit AtomicFile(std::filesystem::path target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(std::span<const std::byte> bytes);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
  // File that becomes the target; another program may write it instead.
  const std::filesystem::path& temporary() const { return temporary_; }
  void commit();
  static void commit(std::span<const std::unique_ptr<AtomicFile>> files);

private:
  void sync();
  void rename();

  std::filesystem::path target_, temporary_;
  int descriptor_;
  bool committed_ = false;
};

void writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void writeFileAtomically(const std::filesystem::path& path, std::string_view text);

// Removes temporaries of AtomicFile that killed processes have left. `owned` returns whether a target name is
// the caller's; temporaries held by a living process stay. The folder may be missing.
void removeAbandoned(const std::filesystem::path& folder,
                     const std::function<bool(const std::string& targetName)>& owned);

// Files that stay open.

// A file that stays open and is read piece by piece, by many threads at once.
class OpenFile {
public:
  // Throws Error as openForReading().
  explicit OpenFile(std::filesystem::path path);
  ~OpenFile();
  OpenFile(OpenFile&& other) noexcept;
  OpenFile& operator=(OpenFile&&) = delete;

  const std::filesystem::path& path() const { return path_; }
  uint64_t bytes() const { return bytes_; } // when it was opened
  // Reads as many bytes as the span has, from a position on. Throws Error naming the file, also if it ends
  // before, or has been written to since it was opened: checksums are checked at opening.
  void read(uint64_t position, std::span<std::byte> bytes) const;
  // Advises the system to read bytes ahead.
  void adviseRead(uint64_t position, uint64_t bytes) const;

private:
  std::filesystem::path path_;
  int descriptor_;
  uint64_t bytes_ = 0;
  int64_t changed_ = 0; // nanoseconds: when it was last written to
};

// Whole numbers in the bytes of a file, in either byte order.

// Number in `count` bytes (at most 4) that lie within `bytes`, the least significant one first.
inline uint32_t littleEndian(std::string_view bytes, size_t at, size_t count = 4) {
  assert(count <= 4 && at + count <= bytes.size());
  uint32_t value = 0;
  for (size_t i = count; i-- > 0;) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

// Number in `count` bytes (at most 4) that lie within `bytes`, the most significant one first.
inline uint32_t bigEndian(std::string_view bytes, size_t at, size_t count = 4) {
  assert(count <= 4 && at + count <= bytes.size());
  uint32_t value = 0;
  for (size_t i = 0; i < count; ++i) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

// 64-bit content hash (XXH3) for checksums and identities of files; not cryptographic.
uint64_t contentHash(std::span<const std::byte> bytes);
uint64_t contentHash(std::string_view text);
std::string hex(uint64_t hash);

} // namespace surflect
