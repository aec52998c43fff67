// Files that stay open.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace surflect {

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
  // before.
  void read(uint64_t position, std::span<std::byte> bytes) const;
  // Advises the system to read bytes ahead.
  void adviseRead(uint64_t position, uint64_t bytes) const;

private:
  std::filesystem::path path_;
  int descriptor_;
  uint64_t bytes_ = 0;
};

} // namespace surflect
