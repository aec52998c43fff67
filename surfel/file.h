// Whole files: read at once, or written so that a reader sees the old file or the complete new one, never a
// part.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect {

// Throws Error naming the file.
std::string readFile(const std::filesystem::path& path);

// Written beside the target, fsynced and renamed by commit(); dropped by the destructor otherwise.
class AtomicFile {
public:
  explicit AtomicFile(std::filesystem::path target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(std::span<const std::byte> bytes);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
  // For libraries that write to a path of their own: the file beside the target. Do not mix with write().
  const std::filesystem::path& temporaryPath() const { return temporary_; }
  void commit();

private:
  std::filesystem::path target_, temporary_;
  int descriptor_;
  bool committed_ = false;
};

void writeFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void writeFileAtomically(const std::filesystem::path& path, std::string_view text);

} // namespace surflect
