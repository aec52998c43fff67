#include "warp/point_cache.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

namespace surflect::warp {

namespace {

constexpr std::string_view kPc2Start("POINTCACHE2\0", 12);
constexpr uint64_t kPc2Header = 32, kMddHeader = 8;

std::string bytesOf(const OpenFile& file, uint64_t position, uint64_t count) {
  std::string bytes(count, '\0');
  file.read(position, std::as_writable_bytes(std::span(bytes)));
  return bytes;
}

float floatAt(std::string_view bytes, size_t at, PointCache::Format format) {
  return std::bit_cast<float>(format == PointCache::Format::pc2 ? littleEndian(bytes, at)
                                                                : bigEndian(bytes, at));
}

uint64_t sampleBytes(size_t points) { return uint64_t{12} * points; }

std::string sampleName(size_t sample) { return "sample[" + std::to_string(sample) + ']'; }

} // namespace

PointCache::PointCache(const std::filesystem::path& path, size_t points) : file_(path), points_(points) {
  inFile(path, [&] {
    const std::string start = bytesOf(file_, 0, std::min<uint64_t>(kPc2Start.size(), file_.bytes()));
    if (start == kPc2Start) {
      format_ = Format::pc2;
      readPc2Times();
    } else {
      readMddTimes();
    }
    const std::string header = bytesOf(file_, 0, firstByte_);
    std::string hashes = hex(surflect::contentHash(header));
    for (size_t sample = 0; sample < times_.size(); ++sample) {
      const std::string bytes =
          bytesOf(file_, firstByte_ + sample * sampleBytes(points_), sampleBytes(points_));
      for (size_t i = 0; i < bytes.size(); i += 4)
        if (const float value = floatAt(bytes, i, format_); !std::isfinite(value))
          throw Error::mismatch("a finite number", numberText(double{value}))
              .at(sampleName(sample) + ".point[" + std::to_string(i / 12) + ']');
      hashes += ' ' + hex(surflect::contentHash(bytes));
    }
    hash_ = surflect::contentHash(hashes);
  });
}

void PointCache::requireCounts(uint64_t samples, uint64_t points, uint64_t headerBytes) {
  if (points != points_)
    throw Error::mismatch(std::to_string(points_) + " as at rest", std::to_string(points)).at("points");
  if (samples == 0) throw Error::mismatch("1 or more", "0").at("samples");
  // At most 2^32 samples of 2^32 points, of which the rest mesh limits the latter: no overflow.
  const uint64_t expected = headerBytes + samples * sampleBytes(points_);
  if (file_.bytes() != expected)
    throw Error::mismatch(std::to_string(expected) + " bytes of " + std::to_string(samples) + " samples of " +
                              std::to_string(points) + " points",
                          std::to_string(file_.bytes()));
  firstByte_ = headerBytes;
}

void PointCache::readMddTimes() {
  if (file_.bytes() < kMddHeader)
    throw Error::mismatch("a point cache in MDD or PC2", std::to_string(file_.bytes()) + " bytes");
  const std::string counts = bytesOf(file_, 0, kMddHeader);
  const uint64_t samples = bigEndian(counts, 0), points = bigEndian(counts, 4);
  requireCounts(samples, points, kMddHeader + 4 * samples);
  const std::string times = bytesOf(file_, kMddHeader, 4 * samples);
  for (size_t i = 0; i < samples; ++i) {
    const double time = floatAt(times, 4 * i, format_);
    if (!std::isfinite(time) || (i > 0 && time <= times_.back()))
      throw Error::mismatch("seconds that rise from sample to sample", numberText(time))
          .at("time[" + std::to_string(i) + ']');
    times_.push_back(time);
  }
}

void PointCache::readPc2Times() {
  if (file_.bytes() < kPc2Header)
    throw Error::mismatch("a header of 32 bytes", std::to_string(file_.bytes()) + " bytes");
  const std::string header = bytesOf(file_, 0, kPc2Header);
  if (const uint32_t version = littleEndian(header, 12); version != 1)
    throw Error::mismatch("1", std::to_string(version)).at("version");
  const double first = floatAt(header, 20, format_), step = floatAt(header, 24, format_);
  if (!std::isfinite(first)) throw Error::mismatch("a finite number", numberText(first)).at("first frame");
  if (!std::isfinite(step) || !(step > 0))
    throw Error::mismatch("more than 0", numberText(step)).at("frames per sample");
  const uint64_t samples = littleEndian(header, 28);
  requireCounts(samples, littleEndian(header, 16), kPc2Header);
  for (size_t i = 0; i < samples; ++i) times_.push_back(first + static_cast<double>(i) * step);
}

std::vector<Vec3<double>> PointCache::positions(size_t sample) const {
  const std::string bytes = bytesOf(file_, firstByte_ + sample * sampleBytes(points_), sampleBytes(points_));
  std::vector<Vec3<double>> positions;
  positions.reserve(points_);
  for (size_t i = 0; i < bytes.size(); i += 12)
    positions.emplace_back(floatAt(bytes, i, format_), floatAt(bytes, i + 4, format_),
                           floatAt(bytes, i + 8, format_));
  return positions;
}

} // namespace surflect::warp
