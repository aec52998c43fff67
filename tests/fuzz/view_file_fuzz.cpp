#include "srf/codec/view_file.h"
#include "surfel/base/file.h"
#include "tests/fuzz/fuzz.h"

#include <cstring>
#include <string>

namespace {

// Checksums are made right, or no damage would come past them.
std::string withRecordChecksums(std::string file) {
  constexpr size_t headerBytes = 40, entryBytes = 12;
  const auto hashOf = [&](size_t begin, size_t count) {
    return surflect::contentHash(std::as_bytes(std::span(file)).subspan(begin, count));
  };
  uint32_t blocks = 0;
  if (file.size() < headerBytes) return file;
  std::memcpy(&blocks, &file[28], sizeof blocks);
  const uint64_t indexEnd = headerBytes + uint64_t{entryBytes} * blocks;
  uint64_t record = indexEnd + 8;
  if (record > file.size()) return file;
  for (uint32_t b = 0; b < blocks; ++b) {
    char* entry = &file[headerBytes + entryBytes * b];
    uint32_t size = 0;
    std::memcpy(&size, entry + 4, sizeof size);
    if (size > file.size() - record) break;
    const auto checksum = static_cast<uint32_t>(hashOf(record, size));
    std::memcpy(entry + 8, &checksum, sizeof checksum);
    record += size;
  }
  const uint64_t checksum = hashOf(0, indexEnd);
  std::memcpy(&file[indexEnd], &checksum, sizeof checksum);
  return file;
}

} // namespace

void surflect::fuzz_view_file(std::string_view input) {
  const codec::ViewFile file(memoryFile(withRecordChecksums(std::string(input))));
  for (uint32_t block = 0; block < file.blockCount(); ++block) file.read(block);
  file.find({file.header().blocksAcross() - 1, file.header().blocksDown() - 1});
}
