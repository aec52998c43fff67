// Whole files: read at once, or written so that a reader sees the old file or the complete new one, never a
// part.
#pragma once

#include "surfel/base/progress.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace surflect {

// Beyond these a file is not what it is taken for.
inline constexpr uint64_t kLargestText = uint64_t{1} << 28; // descriptions that people or exporters write
inline constexpr uint64_t kLargestFile = uint64_t{1} << 35;

// A descriptor to read from; the caller closes it. Throws Error naming the file, also where it is not a
// regular one: a device never ends, a pipe waits for ever.
int openForReading(const std::filesystem::path& path);

// Throws Error naming the file, also where it is not a regular one or larger than `most` bytes, and
// Cancelled.
std::string readFile(const std::filesystem::path& path, uint64_t most = kLargestFile,
                     const Progress& progress = {});
// Its first `count` bytes, or all there are.
std::string readFileStart(const std::filesystem::path& path, size_t count);

// Copies what a file holds into a new one, which stays unfinished when Error or Cancelled is thrown.
void copyFile(const std::filesystem::path& source, const std::filesystem::path& target,
              const Progress& progress = {});

// Written beside the target, fsynced and renamed by commit(); dropped by the destructor otherwise.
//
// Several at once: all are on disk before the first is renamed, so that whoever finds one of them finds it
// whole, whenever the machine stops. They are renamed in order, and their folders fsynced once.
class AtomicFile {
public:
  explicit AtomicFile(std::filesystem::path target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(std::span<const std::byte> bytes);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
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

// Removes what killed processes left beside the targets: temporaries of AtomicFile whose target's name the
// caller owns, and which no living process holds. A folder that is not there has none.
void removeAbandoned(const std::filesystem::path& folder,
                     const std::function<bool(const std::string& targetName)>& owned);

} // namespace surflect
