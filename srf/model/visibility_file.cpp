#include "srf/model/visibility_file.h"

#include "surfel/base/error.h"

#include <zlib.h>

#include <algorithm>
#include <new>
#include <string>

namespace surflect::model {

namespace {

constexpr size_t kPortion = 1 << 18; // bytes between checks for cancellation
// Bytes, and views, that are transposed into rows together: writing one byte a row would miss every cache.
constexpr size_t kTurned = 8 << 20, kMostViews = 16;

struct Deflate : z_stream {
  Deflate() : z_stream{} {
    if (deflateInit(this, 6) != Z_OK) throw std::bad_alloc();
  }
  ~Deflate() { deflateEnd(this); }
  Deflate(const Deflate&) = delete;
  Deflate& operator=(const Deflate&) = delete;
};

struct Inflate : z_stream {
  Inflate() : z_stream{} {
    if (inflateInit(this) != Z_OK) throw std::bad_alloc();
  }
  ~Inflate() { inflateEnd(this); }
  Inflate(const Inflate&) = delete;
  Inflate& operator=(const Inflate&) = delete;
};

} // namespace

// Stored view by view, the few distinct values of fades form long runs, which deflate compresses well.
std::vector<std::byte> packVisibility(const ulr::VisibilityWeights& visibility, const Progress& progress) {
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

ulr::VisibilityWeights unpackVisibility(std::span<const std::byte> packed, size_t surfels, size_t views,
                                        const Progress& progress) {
  const auto mismatch = [&] {
    return Error::mismatch("deflated fades of " + std::to_string(surfels) + " surfels x " +
                               std::to_string(views) + " views",
                           "other content");
  };
  constexpr size_t kDensest = 1032; // largest expansion by deflate, bytes out for each byte in
  const size_t most = kDensest * packed.size();
  if (views > 0 && surfels > most / views) throw mismatch();

  ulr::VisibilityWeights visibility{views, std::vector<uint8_t>(surfels * views)};
  Inflate stream;
  const size_t atOnce =
      std::min(views, std::clamp(kTurned / std::max(surfels, size_t{1}), size_t{1}, kMostViews));
  std::vector<Bytef> columns(surfels * atOnce + 1); // with one extra, to detect surplus data
  size_t read = 0;                                  // bytes given to the stream
  size_t view = 0;                                  // view of the first column
  size_t filled = 0;                                // bytes filled in the columns
  const auto turnColumns = [&] {
    const size_t count = filled / std::max(surfels, size_t{1});
    if (count == 0) return;
    for (size_t i = 0; i < surfels; ++i)
      for (size_t k = 0; k < count; ++k) visibility.values[i * views + view + k] = columns[k * surfels + i];
    view += count;
    filled -= count * surfels;
    std::copy_n(columns.begin() + static_cast<std::ptrdiff_t>(count * surfels), filled, columns.begin());
  };
  for (int status = Z_OK; status != Z_STREAM_END;) {
    progress.checkpoint();
    if (stream.avail_in == 0) {
      const size_t count = std::min(kPortion, packed.size() - read);
      stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(packed.data() + read));
      stream.avail_in = static_cast<uInt>(count);
      read += count;
    }
    const size_t room = std::min(kPortion, columns.size() - filled);
    stream.next_out = columns.data() + filled;
    stream.avail_out = static_cast<uInt>(room);
    status = inflate(&stream, Z_NO_FLUSH); // Z_BUF_ERROR if the data end too early
    filled += room - stream.avail_out;
    if ((status != Z_OK && status != Z_STREAM_END) || filled > visibility.values.size() - view * surfels)
      throw mismatch();
    if (filled + 1 >= columns.size()) turnColumns();
  }
  turnColumns();
  if (view * surfels + filled != visibility.values.size() || read != packed.size() || stream.avail_in != 0)
    throw mismatch();
  return visibility;
}

} // namespace surflect::model
