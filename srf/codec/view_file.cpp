#include "srf/codec/view_file.h"

#include "surfel/base/archive.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace surflect::codec {

namespace {

constexpr size_t headerBytes = 40;
constexpr size_t headChecksumBytes = 8;
constexpr uint32_t mixedPrecisionLayout = 3; // 8x8 blocks without apron, records as encodeBlock makes them

// Head and index, which stand before the records.
struct Head {
  ViewHeader view;
  uint32_t blocks = 0;
  std::vector<ViewIndexEntry> index;
  uint64_t checksum = 0;

  uint64_t bytes() const {
    return headerBytes + sizeof(ViewIndexEntry) * uint64_t{blocks} + headChecksumBytes;
  }
};

// The bounds of white level and tolerance are those of EncodeOptions.
void describeHeader(Archive& archive, Head& head) {
  archive.magic("srf view");
  archive.constant<uint32_t>("version", 1);
  archive.constant<uint32_t>("layout", mixedPrecisionLayout);
  archive.number<uint32_t>("width", head.view.width, {1, largestViewSide});
  archive.number<uint32_t>("height", head.view.height, {1, largestViewSide});
  archive.number<uint32_t>("lights", head.view.lights, {1, mostLights});
  archive.number<uint32_t>("blocks", head.blocks, {0, static_cast<uint32_t>(head.view.cells())});
  archive.number<float>("white", head.view.white, {1e-20f, 1e20f});
  archive.number<float>("tolerance", head.view.tolerance, {0, 1});
}

void describeHead(Archive& archive, Head& head) {
  describeHeader(archive, head);
  archive.array<uint32_t>("index", head.index, head.blocks);
  head.checksum = archive.hash();
  archive.checksum("checksum of header and index", head.checksum);
}

uint32_t recordChecksum(std::span<const std::byte> record) {
  return static_cast<uint32_t>(contentHash(record));
}

ViewIndexEntry entryOf(const ViewHeader& header, const PlacedRecord& block) {
  return {static_cast<uint32_t>(block.position.y * header.blocksAcross() + block.position.x),
          static_cast<uint32_t>(block.record.size()), recordChecksum(block.record)};
}

} // namespace

std::vector<std::byte> viewFileBytes(const ViewHeader& header, std::span<const PlacedRecord> blocks) {
  Head head{header, static_cast<uint32_t>(blocks.size()), {}};
  size_t bytes = head.bytes();
  for (const PlacedRecord& block : blocks) {
    bytes += block.record.size();
    head.index.push_back(entryOf(header, block));
  }
  std::vector<std::byte> file = written(head, describeHead);
  file.reserve(bytes);
  for (const PlacedRecord& block : blocks) file.insert(file.end(), block.record.begin(), block.record.end());
  return file;
}

ViewFileWriter::ViewFileWriter(std::filesystem::path path, const ViewHeader& header)
    : path_(std::move(path)), header_(header), records_(path_.string() + ".records") {}

void ViewFileWriter::add(std::span<const PlacedRecord> blocks) {
  std::vector<std::byte> piece;
  for (const PlacedRecord& block : blocks) {
    index_.push_back(entryOf(header_, block));
    piece.insert(piece.end(), block.record.begin(), block.record.end());
  }
  records_.write(piece);
  bytes_ += piece.size();
}

void ViewFileWriter::commit() {
  constexpr uint64_t kPiece = uint64_t{1} << 24; // bytes
  Head head{header_, static_cast<uint32_t>(index_.size()), std::move(index_)};
  AtomicFile file(path_);
  file.write(written(head, describeHead));
  const OpenFile records(records_.temporary());
  std::vector<std::byte> piece;
  for (uint64_t at = 0; at < bytes_; at += piece.size()) {
    piece.resize(std::min(kPiece, bytes_ - at));
    records.read(at, piece);
    file.write(piece);
  }
  file.commit();
}

ViewFile::ViewFile(std::filesystem::path path) : file_(std::move(path)) {
  Head head;
  inFile(file_.path(), [&] {
    const auto header = bytesAt(0, std::min<uint64_t>(headerBytes, file_.bytes()));
    parse(header, [&](Archive& archive) { describeHeader(archive, head); });
    if (head.bytes() > file_.bytes())
      throw Error::mismatch("at least " + std::to_string(head.bytes()) + " bytes",
                            std::to_string(file_.bytes()))
          .at("size");
    parse(bytesAt(0, head.bytes()), [&](Archive& archive) { describeHead(archive, head); });

    const auto cells = static_cast<uint32_t>(head.view.cells());
    stored_.resize((cells + 63) / 64);
    positions_.reserve(head.blocks), checksums_.reserve(head.blocks);
    offsets_.reserve(head.blocks + size_t{1});
    offsets_.push_back(head.bytes());
    for (size_t b = 0; b < head.index.size(); ++b) {
      const auto& [position, size, checksum] = head.index[b];
      if (position >= cells || (b > 0 && position <= positions_.back()))
        throw Error::mismatch("rising positions below " + std::to_string(cells), std::to_string(position))
            .at("index[" + std::to_string(b) + "].position");
      positions_.push_back(position);
      offsets_.push_back(offsets_.back() + size);
      checksums_.push_back(checksum);
      stored_[position / 64].bits |= uint64_t{1} << position % 64;
    }
    if (offsets_.back() != file_.bytes())
      throw Error::mismatch(std::to_string(offsets_.back()) + " bytes", std::to_string(file_.bytes()))
          .at("size");
  });
  header_ = head.view;
  checksum_ = head.checksum;
  uint32_t before = 0;
  for (Stored& stored : stored_) {
    stored.before = before;
    before += bitCount(stored.bits);
  }
}

UninitializedVector<std::byte> ViewFile::bytesAt(uint64_t offset, size_t count) const {
  UninitializedVector<std::byte> bytes(count);
  file_.read(offset, bytes);
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
  const uint64_t begin = offsets_[stretch.front()];
  file_.adviseRead(begin, offsets_[stretch.back() + 1] - begin);
}

void ViewFile::read(std::span<const uint32_t> stretch, const std::function<void(size_t, Block)>& use) const {
  assert(!stretch.empty() && stretch.back() < blockCount() && std::ranges::is_sorted(stretch));
  const uint64_t begin = offsets_[stretch.front()];
  UninitializedVector<std::byte> bytes;
  try {
    bytes = bytesAt(begin, offsets_[stretch.back() + 1] - begin);
  } catch (Error& error) {
    throw std::move(error).at(nameOf(stretch.front())).in(path());
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
  throw std::move(error).at(nameOf(block)).in(path());
}

std::string ViewFile::nameOf(uint32_t block) const {
  const BlockPosition at = position(block);
  return "block (" + std::to_string(at.x) + ", " + std::to_string(at.y) + ")";
}

} // namespace surflect::codec
