#include "srf/codec/view_file.h"

#include "srf/codec/bytes.h"
#include "surfel/base/file.h"
#include "surfel/base/hash.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace surflect::codec {

namespace {

constexpr std::array magic = {'s', 'r', 'f', ' ', 'v', 'i', 'e', 'w'};
constexpr uint32_t formatVersion = 1;
constexpr uint32_t mixedPrecisionLayout = 3; // 8x8 blocks without apron, records as encodeBlock makes them
constexpr size_t headerBytes = 40;
constexpr size_t indexEntryBytes = 12;
constexpr size_t headChecksumBytes = 8;

uint32_t recordChecksum(std::span<const std::byte> record) {
  return static_cast<uint32_t>(contentHash(record));
}

uint64_t headBytes(uint64_t blocks) { return headerBytes + indexEntryBytes * blocks + headChecksumBytes; }

struct FixedHeader {
  ViewHeader view;
  uint32_t blocks = 0;
};

// Reads an integer in 1 .. limit.
int takeCount(ByteReader& reader, const char* field, int limit) {
  const auto value = reader.take<uint32_t>();
  if (value == 0 || value > static_cast<uint32_t>(limit))
    throw Error::mismatch("1.." + std::to_string(limit), std::to_string(value)).at(field);
  return static_cast<int>(value);
}

void expectEqual(ByteReader& reader, const char* field, uint32_t expected) {
  const auto value = reader.take<uint32_t>();
  if (value != expected) throw Error::mismatch(std::to_string(expected), std::to_string(value)).at(field);
}

FixedHeader takeHeader(ByteReader& reader) {
  if (std::memcmp(reader.take(magic.size()).data(), magic.data(), magic.size()) != 0)
    throw Error::mismatch("a view file", "something else").at("magic");
  expectEqual(reader, "version", formatVersion);
  expectEqual(reader, "layout", mixedPrecisionLayout);
  FixedHeader header;
  header.view.width = takeCount(reader, "width", largestViewSide);
  header.view.height = takeCount(reader, "height", largestViewSide);
  header.view.lights = takeCount(reader, "lights", mostLights);
  header.blocks = reader.take<uint32_t>();
  const int positions = header.view.blocksAcross() * header.view.blocksDown();
  if (header.blocks > static_cast<uint32_t>(positions))
    throw Error::mismatch("at most " + std::to_string(positions), std::to_string(header.blocks)).at("blocks");
  header.view.white = reader.take<float>();
  if (!(header.view.white > 0) || !std::isfinite(header.view.white))
    throw Error::mismatch("a positive number", numberText(header.view.white)).at("white");
  header.view.tolerance = reader.take<float>();
  if (!(header.view.tolerance >= 0) || !std::isfinite(header.view.tolerance))
    throw Error::mismatch("a number not below 0", numberText(header.view.tolerance)).at("tolerance");
  return header;
}

Error systemError(const char* action) {
  return Error(std::string("cannot ") + action + " (" + std::strerror(errno) + ")");
}

} // namespace

std::vector<std::byte> viewFileBytes(const ViewHeader& header, std::span<const PlacedRecord> blocks) {
  std::vector<std::byte> file;
  size_t bytes = headBytes(blocks.size());
  for (const PlacedRecord& block : blocks) bytes += block.record.size();
  file.reserve(bytes);

  for (const char c : magic) append(file, c);
  append(file, formatVersion);
  append(file, mixedPrecisionLayout);
  append(file, static_cast<uint32_t>(header.width));
  append(file, static_cast<uint32_t>(header.height));
  append(file, static_cast<uint32_t>(header.lights));
  append(file, static_cast<uint32_t>(blocks.size()));
  append(file, header.white);
  append(file, header.tolerance);
  for (const PlacedRecord& block : blocks) {
    append(file, static_cast<uint32_t>(block.position.y * header.blocksAcross() + block.position.x));
    append(file, static_cast<uint32_t>(block.record.size()));
    append(file, recordChecksum(block.record));
  }
  append(file, contentHash(file));
  for (const PlacedRecord& block : blocks) file.insert(file.end(), block.record.begin(), block.record.end());
  return file;
}

ViewFile::ViewFile(std::filesystem::path path) : path_(std::move(path)) {
  descriptor_ = openForReading(path_);
  try {
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0) throw systemError("read");
    const auto fileSize = static_cast<uint64_t>(status.st_size);
    const auto fixed = bytesAt(0, std::min<uint64_t>(headerBytes, fileSize));
    ByteReader reader(fixed);
    const uint64_t head = headBytes(takeHeader(reader).blocks);
    if (head > fileSize)
      throw Error::mismatch("at least " + std::to_string(head) + " bytes", std::to_string(fileSize))
          .at("size");
    parse(bytesAt(0, head), fileSize);
  } catch (Error& error) {
    ::close(descriptor_);
    throw std::move(error).in(path_);
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

ViewFile::~ViewFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

ViewFile::ViewFile(ViewFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)),
      header_(other.header_), checksum_(other.checksum_), positions_(std::move(other.positions_)),
      checksums_(std::move(other.checksums_)), offsets_(std::move(other.offsets_)),
      stored_(std::move(other.stored_)) {}

// Parses `head`: header, index and their checksum.
void ViewFile::parse(std::span<const std::byte> head, uint64_t fileSize) {
  ByteReader reader(head);
  const FixedHeader fixed = takeHeader(reader);
  header_ = fixed.view;
  const auto checked = head.first(head.size() - headChecksumBytes);
  const auto checksum = ByteReader(head.last(headChecksumBytes)).take<uint64_t>();
  checksum_ = checksum;
  if (contentHash(checked) != checksum)
    throw Error::mismatch(hex(checksum), hex(contentHash(checked))).at("checksum of header and index");

  const auto positions = static_cast<uint32_t>(header_.blocksAcross() * header_.blocksDown());
  stored_.resize((positions + 63) / 64);
  positions_.reserve(fixed.blocks);
  checksums_.reserve(fixed.blocks);
  offsets_.reserve(fixed.blocks + size_t{1});
  offsets_.push_back(head.size());
  for (uint32_t b = 0; b < fixed.blocks; ++b) {
    const auto place = reader.take<uint32_t>();
    if (place >= positions || (b > 0 && place <= positions_.back()))
      throw Error::mismatch("rising positions below " + std::to_string(positions), std::to_string(place))
          .at("index[" + std::to_string(b) + "].position");
    positions_.push_back(place);
    offsets_.push_back(offsets_.back() + reader.take<uint32_t>());
    checksums_.push_back(reader.take<uint32_t>());
    stored_[place / 64].bits |= uint64_t{1} << place % 64;
  }
  if (offsets_.back() != fileSize)
    throw Error::mismatch(std::to_string(offsets_.back()) + " bytes", std::to_string(fileSize)).at("size");

  uint32_t before = 0;
  for (Stored& stored : stored_) {
    stored.before = before;
    before += bitCount(stored.bits);
  }
}

UninitializedVector<std::byte> ViewFile::bytesAt(uint64_t offset, size_t count) const {
  UninitializedVector<std::byte> bytes(count);
  for (size_t done = 0; done < count;) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data() + done, count - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw systemError("read");
    if (got == 0) throw Error::mismatch(std::to_string(count) + " bytes", std::to_string(done));
    done += static_cast<size_t>(got);
  }
  return bytes;
}

BlockPosition ViewFile::position(uint32_t block) const {
  const int across = header_.blocksAcross();
  const auto place = static_cast<int>(positions_[block]);
  return {place % across, place / across};
}

size_t ViewFile::readRunLength(std::span<const uint32_t> blocks) const {
  assert(!blocks.empty() && blocks.back() < blockCount());
  // The largest gap, in bytes, that is read rather than skipped; the largest read-ahead, in bytes, that the
  // system accepts; and the largest number of blocks in a stretch, limited so that other threads get work
  // too.
  constexpr uint64_t kGap = 1 << 14, kMost = 1 << 17;
  constexpr size_t kMostBlocks = 64;
  const uint64_t begin = offsets_[blocks[0]];
  uint64_t end = begin;
  size_t count = 0;
  for (const size_t most = std::min(kMostBlocks, blocks.size());
       count < most && offsets_[blocks[count]] <= end + kGap && end < begin + kMost; ++count)
    end = offsets_[blocks[count] + 1];
  return count;
}

void ViewFile::adviseRead(std::span<const uint32_t> stretch) const {
  const uint64_t begin = offsets_[stretch.front()], end = offsets_[stretch.back() + 1];
  // Only a hint: if it fails, reading is merely slower.
  ::posix_fadvise(descriptor_, static_cast<off_t>(begin), static_cast<off_t>(end - begin),
                  POSIX_FADV_WILLNEED);
}

void ViewFile::read(std::span<const uint32_t> stretch, const std::function<void(size_t, Block)>& use) const {
  assert(!stretch.empty() && stretch.back() < blockCount() && std::ranges::is_sorted(stretch));
  const uint64_t begin = offsets_[stretch.front()];
  UninitializedVector<std::byte> bytes;
  try {
    bytes = bytesAt(begin, offsets_[stretch.back() + 1] - begin);
  } catch (Error& error) {
    throw std::move(error).at(nameOf(stretch.front())).in(path_);
  }
  for (size_t i = 0; i < stretch.size(); ++i)
    use(i,
        decode(stretch[i], std::span(bytes).subspan(offsets_[stretch[i]] - begin, storedBytes(stretch[i]))));
}

Block ViewFile::read(uint32_t block) const {
  Block only;
  read({&block, 1}, [&](size_t, Block found) { only = std::move(found); });
  return only;
}

Block ViewFile::decode(uint32_t block, std::span<const std::byte> record) const try {
  if (const uint32_t found = recordChecksum(record); found != checksums_[block])
    throw Error::mismatch(std::to_string(checksums_[block]), std::to_string(found)).at("checksum");
  return decodeBlock(record, static_cast<size_t>(header_.lights));
} catch (Error& error) {
  throw std::move(error).at(nameOf(block)).in(path_);
}

std::string ViewFile::nameOf(uint32_t block) const {
  const BlockPosition at = position(block);
  return "block (" + std::to_string(at.x) + ", " + std::to_string(at.y) + ")";
}

} // namespace surflect::codec
