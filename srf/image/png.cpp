#include "srf/image/png.h"

#include "srf/image/picture_limits.h"
#include "srf/image/png_color.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/message_text.h"

#include <png.h>

#include <csetjmp>
#include <cstring>
#include <string>

// libpng reports errors by longjmp, which skips destructors. So functions that call setjmp own nothing: their
// caller owns all allocations.

namespace surflect::image {

namespace {

[[noreturn]] void onError(png_structp png, png_const_charp message) {
  *static_cast<std::string*>(png_get_error_ptr(png)) = message;
  png_longjmp(png, 1);
}
void onWarning(png_structp, png_const_charp) {}

// Memory used while libpng decodes a picture.
struct Samples {
  std::vector<std::byte> bytes;
  std::vector<png_bytep> rows;

  Samples(size_t rowBytes, size_t height) : bytes(rowBytes * height), rows(height) {
    for (size_t y = 0; y < height; ++y) rows[y] = reinterpret_cast<png_bytep>(bytes.data() + y * rowBytes);
  }
};

float sampleAt(const Samples& samples, size_t index, int bitDepth) {
  if (bitDepth == 8) return static_cast<float>(samples.bytes[index]) / 255;
  uint16_t value;
  std::memcpy(&value, samples.bytes.data() + 2 * index, sizeof value);
  return static_cast<float>(value) / 65535;
}

class Reader {
public:
  explicit Reader(std::string_view file)
      : rest_(file), png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, &problem_, onError, onWarning)),
        info_(png_ ? png_create_info_struct(png_) : nullptr) {}
  ~Reader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  // Steps of reading; each returns false if libpng gave up, and problem() tells why.
  bool readHeader() {
    if (!info_ || setjmp(png_jmpbuf(png_))) return false;
    png_set_read_fn(png_, this, onRead);
    png_set_user_limits(png_, kMostSide, kMostSide);
    png_read_info(png_, info_);
    png_set_expand(png_);
    if constexpr (std::endian::native == std::endian::little) png_set_swap(png_);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return true;
  }
  bool readRows(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_))) return false;
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

  const std::string& problem() const { return problem_; }
  int width() const { return static_cast<int>(png_get_image_width(png_, info_)); }
  int height() const { return static_cast<int>(png_get_image_height(png_, info_)); }
  int channels() const { return png_get_channels(png_, info_); }
  int bitDepth() const { return png_get_bit_depth(png_, info_); }
  size_t rowBytes() const { return png_get_rowbytes(png_, info_); }

private:
  static void onRead(png_structp png, png_bytep bytes, size_t count) {
    auto& rest = static_cast<Reader*>(png_get_io_ptr(png))->rest_;
    if (count > rest.size()) png_error(png, "the file is truncated");
    std::memcpy(bytes, rest.data(), count);
    rest.remove_prefix(count);
  }

  std::string_view rest_;
  std::string problem_ = "out of memory";
  png_structp png_;
  png_infop info_;
};

} // namespace

PngPicture readPng(const std::filesystem::path& path) {
  const std::string file = readFile(path);
  Reader reader(file);
  if (!reader.readHeader()) throw Error("cannot read (" + reader.problem() + ")").in(path);
  const size_t height = static_cast<size_t>(reader.height());
  if (int64_t{reader.width()} * reader.height() > kMostPixels)
    throw Error::mismatch("at most 2^28 pixels", sizeText(reader.width(), reader.height())).in(path);
  // Deflate grows data at most 1032-fold, so a file that claims more pixels than that cannot hold them.
  if (reader.rowBytes() * height > 1032 * file.size() * (reader.bitDepth() == 8 ? 8 : 1))
    throw Error("cannot read (the file is truncated)").in(path);

  Samples samples(reader.rowBytes(), height);
  if (!reader.readRows(samples.rows.data())) throw Error("cannot read (" + reader.problem() + ")").in(path);
  PngPicture picture{Image(reader.width(), reader.height(), reader.channels()), reader.bitDepth(),
                     pngColorStatement(file)};
  for (size_t i = 0; i < picture.image.values.size(); ++i)
    picture.image.values[i] = sampleAt(samples, i, picture.bitDepth);
  return picture;
}

PngHeader readPngHeader(const std::filesystem::path& path) {
  constexpr size_t kUsually = size_t{1} << 16, kDepth = 24,
                   kColorType = 25; // offsets of IHDR's fields in the file
  std::string start = readFileStart(path, kUsually);
  const auto* head = reinterpret_cast<const png_byte*>(start.data());
  if (start.size() <= kColorType || png_sig_cmp(head, 0, 8) != 0)
    throw Error("cannot read (not a PNG file)").in(path);
  const uint32_t width = png_get_uint_32(head + 16), height = png_get_uint_32(head + 20);
  if (width < 1 || height < 1 || int64_t{width} * height > kMostPixels)
    throw Error::mismatch("at most 2^28 pixels", sizeText(width, height)).in(path);
  if (!hasPngChunk(start, "IDAT")) start = readFile(path);
  return {static_cast<int>(width), static_cast<int>(height),
          (start[kColorType] & PNG_COLOR_MASK_ALPHA) != 0 || hasPngChunk(start, "tRNS"),
          start[kDepth] == 16 ? 16 : 8, pngColorStatement(start)};
}

} // namespace surflect::image
