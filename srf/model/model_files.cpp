#include "srf/model/model_files.h"

#include "srf/image/deflate.h"
#include "surfel/base/archive.h"
#include "surfel/base/error.h"
#include "surfel/base/memory.h"

#include <libdeflate.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <numbers>
#include <string>

namespace surflect::model {

namespace {

constexpr size_t kDensest = 1032; // largest expansion by deflate, bytes out for each byte in

// Inflates a stream to a known number of bytes. Throws Error at the field.
template <class Byte> std::vector<Byte> inflated(const std::string& stream, size_t count, const char* field) {
  std::vector<Byte> bytes(count <= kDensest * stream.size() ? count : 0);
  if (bytes.size() != count ||
      !image::inflatesTo(std::as_bytes(std::span(stream)), std::as_writable_bytes(std::span(bytes))))
    throw Error::mismatch("a zlib stream of " + std::to_string(count) + " bytes", "other content").at(field);
  return bytes;
}

void describeAlpha(Archive& archive, std::string& levels, int width, int height) {
  archive.magic("srf alph");
  archive.constant<uint32_t>("version", 1);
  archive.constant<uint32_t>("width", static_cast<uint32_t>(width));
  archive.constant<uint32_t>("height", static_cast<uint32_t>(height));
  archive.array<char>("levels", levels, archive.left());
}

} // namespace

std::vector<std::byte> packAlpha(const codec::AlphaPlane& plane) {
  const std::vector<uint8_t> levels = plane.levels();
  const std::string stream = image::zlibStream(std::as_bytes(std::span(levels)));
  return written(stream, [&](Archive& archive, std::string& content) {
    describeAlpha(archive, content, plane.width(), plane.height());
  });
}

codec::AlphaPlane unpackAlpha(std::span<const std::byte> content, int width, int height) {
  std::string stream;
  parse(content, [&](Archive& archive) { describeAlpha(archive, stream, width, height); });
  const size_t count = static_cast<size_t>(width) * static_cast<size_t>(height);
  return {width, height, inflated<uint8_t>(stream, count, "levels")};
}

namespace {

// Levels as they are stored. Splats of level 0 are those of the cloud.
struct StoredLevels {
  size_t count = 0;
  std::vector<uint8_t> last;        // of each surfel, the last level that contains it
  std::vector<DetailSplat> further; // of levels 1..last, surfel by surfel
};

void describeLevels(Archive& archive, StoredLevels& levels, size_t surfels) {
  archive.magic("srf lods");
  archive.constant<uint32_t>("version", 1);
  archive.number<uint32_t>("levels", levels.count, {1, kMostLevels});
  archive.constant<uint32_t>("surfels", static_cast<uint32_t>(surfels));
  archive.array<uint8_t>("last", levels.last, surfels, Below(levels.count));
  size_t further = 0;
  for (const uint8_t last : levels.last) further += last;
  archive.array<float>("splats", levels.further, further, {0});
}

// Throws Error unless each level is the last one of a surfel, so that each level has fewer surfels than the
// one before.
void requireNested(const StoredLevels& levels) {
  std::array<size_t, kMostLevels> surfelsUpTo{};
  for (const uint8_t last : levels.last) ++surfelsUpTo[last];
  for (size_t level = 0; level < levels.count; ++level)
    if (surfelsUpTo[level] == 0 && (levels.count > 1 || !levels.last.empty()))
      throw Error::mismatch("fewer surfels in the next", "as many")
          .at("level[" + std::to_string(level) + "]");
}

} // namespace

std::vector<std::byte> packLevels(const LevelsOfDetail& levels) {
  StoredLevels stored{levels.count, {}, {}};
  for (size_t i = 0; i + 1 < levels.first.size(); ++i) {
    const auto splats = levels.of(i);
    stored.last.push_back(static_cast<uint8_t>(splats.size() - 1));
    stored.further.insert(stored.further.end(), splats.begin() + 1, splats.end());
  }
  return written(stored,
                 [](Archive& archive, StoredLevels& own) { describeLevels(archive, own, own.last.size()); });
}

LevelsOfDetail unpackLevels(std::span<const std::byte> packed, const SurfelCloud& cloud,
                            const Progress& progress) {
  StoredLevels stored;
  parse(packed, [&](Archive& archive) { describeLevels(archive, stored, cloud.size()); });
  requireNested(stored);
  if (stored.further.size() + cloud.size() > std::numeric_limits<uint32_t>::max())
    throw Error::mismatch("fewer than 2^32", std::to_string(stored.further.size() + cloud.size()))
        .at("splats");
  LevelsOfDetail levels{.count = stored.count, .first = {0}, .splats = {}};
  levels.first.reserve(cloud.size() + 1);
  levels.splats.reserve(stored.further.size() + cloud.size());
  auto further = stored.further.begin();
  for (size_t i = 0; i < cloud.size(); ++i) {
    progress.checkNowAndThen(i);
    levels.splats.push_back({cloud.radius[i], cloud.coverage[i]});
    levels.splats.insert(levels.splats.end(), further, further + stored.last[i]);
    further += stored.last[i];
    levels.first.push_back(static_cast<uint32_t>(levels.splats.size()));
  }
  return levels;
}

namespace {

// Shared reflectance as it is stored.
struct StoredTables {
  uint32_t version = 3;
  float white = 1;
  std::array<uint32_t, 4> nodes{};
  uint32_t count = 0;
  std::vector<float> trust;
  std::vector<uint16_t> values;                // half floats
  std::vector<uint16_t> fibres;                // 0..65535 for a half turn
  std::vector<std::array<uint8_t, 3>> mixed;   // tables
  std::vector<std::array<uint8_t, 3>> weights; // sum: 255
  std::vector<std::array<uint16_t, 3>> gains;  // half floats
  std::vector<std::array<int16_t, 2>> tilts;   // in units of kTiltUnit
  std::string stream;                          // of all arrays
};
static_assert(reflectance::kMixedTables == 3);

constexpr size_t kTableEffort = 6;
constexpr float kWhole = 255;          // sum of weights
constexpr double kHalfTurn = 0x1p16;   // stored angles
constexpr uint16_t kGreatest = 0x7bff; // bits of the greatest half float
constexpr float kTiltUnit = 0x1p-14f;
constexpr auto kGreatestTilt = static_cast<int16_t>(reflectance::kMostTilt / kTiltUnit);

void describeArrays(Archive& archive, StoredTables& tables, size_t surfels) {
  const reflectance::TableGrid grid{tables.nodes};
  archive.array<uint16_t>("values", tables.values, size_t{3} * tables.count * grid.size());
  archive.array<uint16_t>("fibres", tables.fibres, surfels);
  archive.array<uint8_t>("mixed tables", tables.mixed, surfels, Below(tables.count));
  archive.array<uint8_t>("weights", tables.weights, surfels);
  archive.array<uint16_t>("gains", tables.gains, surfels, {0, kGreatest});
  if (tables.version >= 3)
    archive.array<int16_t>("tilts", tables.tilts, surfels, {-kGreatestTilt, kGreatestTilt});
}

size_t bytesOfArrays(const StoredTables& tables, size_t surfels) {
  return size_t{6} * tables.count * reflectance::TableGrid{tables.nodes}.size() +
         (tables.version >= 3 ? 18 : 14) * surfels;
}

// Version 3 adds tilts; version 2 has the arrays as a stream, version 1 as they are.
void describeTables(Archive& archive, StoredTables& tables, size_t surfels) {
  archive.magic("srf tabs");
  archive.number<uint32_t>("version", tables.version, {1, 3});
  archive.number<float>("white", tables.white, {1e-12f, 1e12f});
  archive.numbers<uint32_t>("nodes", tables.nodes, {3, 255});
  for (const uint32_t nodes : tables.nodes)
    if (nodes % 2 == 0) throw Error::mismatch("odd numbers", std::to_string(nodes)).at("nodes");
  archive.number<uint32_t>("tables", tables.count, {1, 255});
  archive.constant<uint32_t>("surfels", static_cast<uint32_t>(surfels));
  archive.array<float>("trust", tables.trust, tables.count, {0, 1});
  if (tables.version == 1)
    describeArrays(archive, tables, surfels);
  else
    archive.array<char>("arrays", tables.stream, archive.left());
}

// Weights as 255ths, whose sum stays whole.
std::array<uint8_t, 3> wholeWeights(const std::array<float, 3>& weights) {
  const auto second = static_cast<uint8_t>(std::lround(kWhole * weights[1])),
             third = static_cast<uint8_t>(std::lround(kWhole * weights[2]));
  return {static_cast<uint8_t>(255 - second - third), second, third};
}

uint16_t bitsOf(float value) { return std::bit_cast<uint16_t>(Eigen::half(value)); }

} // namespace

std::vector<std::byte> packTables(const reflectance::SharedReflectance& shared) {
  StoredTables stored{.white = shared.white,
                      .nodes = shared.tables.grid.nodes,
                      .count = static_cast<uint32_t>(shared.tables.count()),
                      .trust = shared.trust};
  for (const auto& [r, g, b, _] : shared.tables.values)
    for (const float value : {r, g, b}) stored.values.push_back(bitsOf(value));
  for (size_t i = 0; i < shared.gains.size(); ++i) {
    const double turn = shared.fibres[i].radians() / std::numbers::pi;
    stored.fibres.push_back(static_cast<uint16_t>(std::llround(kHalfTurn * (turn - std::floor(turn)))));
    const auto wholeTilt = [](float slope) { return static_cast<int16_t>(std::lround(slope / kTiltUnit)); };
    stored.tilts.push_back({wholeTilt(shared.tilts[i].u), wholeTilt(shared.tilts[i].v)});
    const reflectance::TableMixture& mixture = shared.mixtures[i];
    stored.mixed.push_back({static_cast<uint8_t>(mixture.table[0]), static_cast<uint8_t>(mixture.table[1]),
                            static_cast<uint8_t>(mixture.table[2])});
    stored.weights.push_back(wholeWeights(mixture.weight));
    stored.gains.push_back({bitsOf(shared.gains[i].r), bitsOf(shared.gains[i].g), bitsOf(shared.gains[i].b)});
  }
  const size_t surfels = stored.gains.size();
  stored.stream = image::zlibStream(
      written(stored, [&](Archive& archive, StoredTables& own) { describeArrays(archive, own, surfels); }),
      kTableEffort);
  return written(stored, [&](Archive& archive, StoredTables& own) { describeTables(archive, own, surfels); });
}

reflectance::SharedReflectance unpackTables(std::span<const std::byte> packed, size_t surfels) {
  StoredTables stored;
  parse(packed, [&](Archive& archive) { describeTables(archive, stored, surfels); });
  if (stored.version >= 2)
    parse(inflated<std::byte>(stored.stream, bytesOfArrays(stored, surfels), "arrays"),
          [&](Archive& archive) { describeArrays(archive, stored, surfels); });
  reflectance::SharedReflectance shared{.white = stored.white,
                                        .tables = {{stored.nodes}, {}},
                                        .trust = stored.trust,
                                        .tilts = std::vector<reflectance::Tilt>(surfels),
                                        .fibres = {},
                                        .mixtures = {},
                                        .gains = {}};
  const auto valueOf = [](uint16_t bits) { return static_cast<float>(std::bit_cast<Eigen::half>(bits)); };
  for (const uint16_t bits : stored.values)
    if ((bits & 0x7fff) > kGreatest) throw Error::mismatch("finite half floats", "another").at("values");
  for (size_t i = 0; i < stored.values.size(); i += 3)
    shared.tables.values.push_back(
        {valueOf(stored.values[i]), valueOf(stored.values[i + 1]), valueOf(stored.values[i + 2])});
  for (size_t i = 0; i < surfels; ++i) {
    const auto& [r, g, b] = stored.gains[i];
    shared.gains.push_back({valueOf(r), valueOf(g), valueOf(b)});
    if (!stored.tilts.empty())
      shared.tilts[i] = {static_cast<float>(stored.tilts[i][0]) * kTiltUnit,
                         static_cast<float>(stored.tilts[i][1]) * kTiltUnit};
    shared.fibres.push_back(Angle::fromRadians(stored.fibres[i] / kHalfTurn * std::numbers::pi));
    const auto& weights = stored.weights[i];
    if (weights[0] + weights[1] + weights[2] != 255)
      throw Error::mismatch("the sum 255", std::to_string(weights[0] + weights[1] + weights[2]))
          .at("weights[" + std::to_string(i) + "]");
    reflectance::TableMixture mixture;
    for (size_t m = 0; m < reflectance::kMixedTables; ++m) {
      mixture.table[m] = stored.mixed[i][m];
      mixture.weight[m] = static_cast<float>(weights[m]) / kWhole;
    }
    shared.mixtures.push_back(mixture);
  }
  return shared;
}

namespace {

constexpr size_t kPortion = 1 << 18; // bytes between checks for cancellation
// Bytes, and views, that are transposed into rows together: with 64 views, whole cache lines are written.
constexpr size_t kTurned = 40 << 20, kMostViews = 64;

struct Deflate : z_stream {
  Deflate() : z_stream{} {
    if (deflateInit(this, 6) != Z_OK) throw std::bad_alloc();
  }
  ~Deflate() { deflateEnd(this); }
  Deflate(const Deflate&) = delete;
  Deflate& operator=(const Deflate&) = delete;
};

// Inflates a zlib stream in pieces of known sizes.
class Inflate {
public:
  Inflate(std::span<const std::byte> packed, const Progress& progress)
      : packed_(packed), progress_(progress) {
    // Without the checksum, which zlib computes slowly.
    if (inflateInit(&stream_) != Z_OK || inflateValidate(&stream_, 0) != Z_OK) throw std::bad_alloc();
  }
  ~Inflate() { inflateEnd(&stream_); }
  Inflate(const Inflate&) = delete;
  Inflate& operator=(const Inflate&) = delete;

  // Fills the whole span; returns whether there were enough bytes.
  bool fill(std::span<Bytef> out) {
    while (!out.empty()) {
      const auto portion = out.first(std::min(kPortion, out.size()));
      if (take(portion) != portion.size()) return false;
      checksum_ = ::libdeflate_adler32(checksum_, portion.data(), portion.size());
      out = out.subspan(portion.size());
    }
    return true;
  }
  // Returns whether the stream has ended with the right checksum, and the bytes with it.
  bool isAtEnd() {
    Bytef surplus = 0;
    if (take({&surplus, 1}) != 0 || !ended_ || read_ != packed_.size() || stream_.avail_in != 0) return false;
    uint32_t stated = 0; // the last four bytes, big-endian
    for (const std::byte byte : packed_.last(4)) stated = stated << 8 | std::to_integer<uint32_t>(byte);
    return stated == checksum_;
  }

private:
  // Inflates as many bytes as there are, up to the span's size.
  size_t take(std::span<Bytef> out) {
    stream_.next_out = out.data();
    stream_.avail_out = static_cast<uInt>(out.size());
    while (stream_.avail_out > 0 && !ended_) {
      progress_.checkpoint();
      if (stream_.avail_in == 0) {
        const auto portion = packed_.subspan(read_, std::min(kPortion, packed_.size() - read_));
        stream_.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(portion.data()));
        stream_.avail_in = static_cast<uInt>(portion.size());
        read_ += portion.size();
      }
      const int status = inflate(&stream_, Z_NO_FLUSH); // Z_BUF_ERROR if the data end too early
      ended_ = status == Z_STREAM_END;
      if (status != Z_OK && !ended_) break;
    }
    return out.size() - stream_.avail_out;
  }

  std::span<const std::byte> packed_;
  const Progress& progress_;
  z_stream stream_{};
  size_t read_ = 0; // bytes given to the stream
  uint32_t checksum_ = 1;
  bool ended_ = false;
};

using Square = std::array<uint8_t, 256>; // 16 x 16 bytes, row by row

// Interleaves the two halves of `from`, which rotates the eight binary digits of each byte's place by one.
void shuffle(const Square& from, Square& to) {
  for (size_t k = 0; k < from.size() / 2; ++k) {
    to[2 * k] = from[k];
    to[2 * k + 1] = from[from.size() / 2 + k];
  }
}

// Transposes: four shuffles exchange the four digits of the row with those of the column. Compilers make
// vector instructions of them.
void transpose(Square& square) {
  Square other;
  for (int twice = 0; twice < 2; ++twice) {
    shuffle(square, other);
    shuffle(other, square);
  }
}

// Copies up to 16 bytes; almost always 16, which is one instruction.
void copyUpTo16(const uint8_t* from, size_t count, uint8_t* to) {
  if (count == 16)
    std::memcpy(to, from, 16);
  else
    std::memcpy(to, from, count);
}

// Writes columns of neighbouring views (`surfels` bytes each) into the rows of surfels: `rows` begins at the
// first of the views, and rows are `stride` bytes apart.
void turnColumns(std::span<const uint8_t> columns, size_t surfels, uint8_t* rows, size_t stride) {
  const size_t count = columns.size() / surfels;
  constexpr size_t kTile = 4096;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, surfels, kTile), [&](const auto& tile) {
    for (size_t i = tile.begin(); i < tile.end(); i += 16)
      for (size_t k = 0; k < count; k += 16) {
        const size_t down = std::min<size_t>(16, tile.end() - i), across = std::min<size_t>(16, count - k);
        Square square{};
        for (size_t c = 0; c < across; ++c)
          copyUpTo16(columns.data() + (k + c) * surfels + i, down, square.data() + 16 * c);
        transpose(square);
        for (size_t r = 0; r < down; ++r)
          copyUpTo16(square.data() + 16 * r, across, rows + (i + r) * stride + k);
      }
  });
}

// Work of other threads, which is waited for in any case, as it uses memory of the caller.
struct WaitedFor : tbb::task_group {
  ~WaitedFor() { wait(); }
};

} // namespace

// Stored view by view, the few distinct values of fades form long runs, which deflate compresses well.
std::vector<std::byte> packVisibility(const weights::VisibilityWeights& visibility,
                                      const Progress& progress) {
  const size_t surfels = visibility.views ? visibility.values.size() / visibility.views : 0;
  std::vector<std::byte> packed;
  Deflate stream;
  std::vector<Bytef> in(kPortion), out(kPortion);
  const auto give = [&](size_t count, int flush) {
    stream.next_in = in.data();
    stream.avail_in = static_cast<uInt>(count);
    do {
      progress.checkpoint();
      stream.next_out = out.data();
      stream.avail_out = static_cast<uInt>(out.size());
      deflate(&stream, flush);
      const auto bytes = std::as_bytes(std::span(out).first(out.size() - stream.avail_out));
      packed.insert(packed.end(), bytes.begin(), bytes.end());
    } while (stream.avail_out == 0);
  };
  size_t held = 0;
  for (size_t view = 0; view < visibility.views; ++view)
    for (size_t i = 0; i < surfels; ++i) {
      in[held++] = visibility.values[i * visibility.views + view];
      if (held == in.size()) {
        give(held, Z_NO_FLUSH);
        held = 0;
      }
    }
  give(held, Z_FINISH);
  return packed;
}

// Columns are inflated while those before them are written into rows.
weights::VisibilityWeights unpackVisibility(std::span<const std::byte> packed, size_t surfels, size_t views,
                                            const Progress& progress) {
  const auto mismatch = [&] {
    return Error::mismatch("deflated fades of " + std::to_string(surfels) + " surfels x " +
                               std::to_string(views) + " views",
                           "other content");
  };
  constexpr size_t kDensest = 1032; // largest expansion by deflate, bytes out for each byte in
  const size_t most = kDensest * packed.size();
  if (views > 0 && surfels > most / views) throw mismatch();

  weights::VisibilityWeights visibility{views, std::vector<uint8_t>(surfels * views)};
  Inflate stream(packed, progress);
  const size_t fitting = std::clamp(kTurned / std::max(surfels, size_t{1}), size_t{1}, kMostViews);
  std::array<UninitializedVector<uint8_t>, 2> memory;
  // Isolated: a wait for columns must not take up long work of the caller's.
  tbb::this_task_arena::isolate([&] {
    WaitedFor turning;
    for (size_t view = 0; surfels > 0 && view < views; view += fitting) {
      UninitializedVector<uint8_t>& held = memory[view / fitting % 2];
      held.resize(surfels * std::min(fitting, views - view));
      const std::span columns(held);
      if (!stream.fill(columns)) throw mismatch();
      turning.wait();
      turning.run(
          [&, view, columns] { turnColumns(columns, surfels, visibility.values.data() + view, views); });
    }
  });
  if (!stream.isAtEnd()) throw mismatch();
  return visibility;
}

} // namespace surflect::model
