#include "srf/image/png.h"

#include "srf/image/icc.h"
#include "srf/image/image.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstring>
#include <map>
#include <string>

namespace surflect::image {

// [PNG 3] Portable Network Graphics Specification, third edition: 4.3 the order of precedence, 5.3 chunks,
// 11.3.2 cHRM, gAMA, iCCP, sRGB and cICP. [H.273] the code points of cICP. Read here rather than by libpng,
// which drops a damaged chunk with a warning and does not know cICP.
namespace {

struct Chunk {
  std::string_view counted;  // name and content, as far as present
  std::string_view checksum; // 4 bytes, or fewer at the end of the file

  std::string_view name() const { return counted.substr(0, 4); }
  // Content of the chunk; throws Error if it is damaged.
  std::string_view content() const {
    const auto sum =
        ::crc32(0, reinterpret_cast<const Bytef*>(counted.data()), static_cast<uInt>(counted.size()));
    if (checksum.size() < 4 || sum != bigEndian(checksum, 0))
      throw Error("the checksum is wrong").at(std::string(name()));
    return counted.substr(4);
  }
};

// Calls visit(chunk) for each chunk with a complete name, until it returns false.
template <class Visit> void forChunks(std::string_view file, const Visit& visit) {
  constexpr size_t kSignature = 8, kName = 4, kAround = 12; // kAround: length, name and checksum
  for (size_t at = kSignature; at + 8 <= file.size();) {
    const size_t length = bigEndian(file, at), end = std::min(at + 8 + length, file.size());
    if (!visit(Chunk{file.substr(at + 4, std::min(kName + length, end - at - 4)), file.substr(end, 4)}))
      return;
    at += kAround + length;
  }
}

Error lengthError(std::string_view content, const std::string& expected) {
  return Error::mismatch(expected + " bytes", std::to_string(content.size()) + " bytes");
}

// Encoding by code points of [H.273] 8.1 and 8.2; samples are RGB of full range.
ColorEncoding encodingOfCicp(std::string_view content) {
  if (content.size() != 4) throw lengthError(content, "4");
  const int primaries = static_cast<uint8_t>(content[0]), transfer = static_cast<uint8_t>(content[1]),
            matrix = static_cast<uint8_t>(content[2]), fullRange = static_cast<uint8_t>(content[3]);
  static const std::map<int, std::optional<Primaries>> knownPrimaries{
      {1, kRec709},
      {2, std::nullopt}, // unspecified
      {5, Primaries{{0.64, 0.33}, {0.29, 0.60}, {0.15, 0.06}, kD65}},
      {6, Primaries{{0.630, 0.340}, {0.310, 0.595}, {0.155, 0.070}, kD65}},
      {9, kRec2020},
      {11, Primaries{{0.680, 0.320}, {0.265, 0.690}, {0.15, 0.06}, {0.314, 0.351}}},
      {12, kDisplayP3}};
  using Curve = Transfer::Curve;
  static const std::map<int, std::optional<Transfer>> knownTransfers{
      {1, Transfer{Curve::bt709}},      {2, std::nullopt}, // unspecified
      {4, Transfer{Curve::gamma, 2.2}}, {5, Transfer{Curve::gamma, 2.8}},
      {6, Transfer{Curve::bt709}},      {8, Transfer{Curve::linear}},
      {13, Transfer{Curve::srgb}},      {14, Transfer{Curve::bt709}},
      {15, Transfer{Curve::bt709}}};
  if (transfer == 16) throw Error("the curve is PQ, which is not supported");
  if (transfer == 18) throw Error("the curve is HLG, which is not supported");
  if (!knownPrimaries.contains(primaries))
    throw Error::mismatch("1, 2, 5, 6, 9, 11 or 12", std::to_string(primaries)).at("colour primaries");
  if (!knownTransfers.contains(transfer))
    throw Error::mismatch("1, 2, 4, 5, 6, 8, 13, 14 or 15", std::to_string(transfer)).at("transfer function");
  if (matrix != 0) throw Error::mismatch("0, RGB", std::to_string(matrix)).at("matrix coefficients");
  if (fullRange != 1) throw Error::mismatch("1, full range", std::to_string(fullRange)).at("range");
  return {knownTransfers.at(transfer), knownPrimaries.at(primaries), nullptr};
}

// Profile of an iCCP chunk: a name, a zero, the compression method (0), and the deflated profile.
std::string profileOf(std::string_view content) {
  constexpr size_t kLargestProfile = size_t{1} << 26, kStep = size_t{1} << 16;
  const size_t end = content.find('\0');
  if (end == content.npos || end + 2 > content.size() || content[end + 1] != 0)
    throw Error("no name and method of compression 0");
  const std::string_view packed = content.substr(end + 2);
  std::string profile;
  z_stream stream{};
  if (::inflateInit(&stream) != Z_OK) throw Error("out of memory");
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  int result = Z_OK;
  while (result == Z_OK && profile.size() < kLargestProfile) {
    const size_t before = profile.size();
    profile.resize(before + kStep);
    stream.next_out = reinterpret_cast<Bytef*>(profile.data() + before);
    stream.avail_out = kStep;
    result = ::inflate(&stream, Z_NO_FLUSH);
    profile.resize(before + kStep - stream.avail_out);
  }
  ::inflateEnd(&stream);
  if (result != Z_STREAM_END) throw Error("the profile cannot be decompressed");
  return profile;
}

// Transfer by gAMA: light = sample ^ (1 / gAMA), stored times 100000. sRGB files state 45455 (1/2.2) for
// readers without the sRGB chunk [PNG 3, 11.3.2.5], so with sRGB primaries, or none, it means the sRGB curve.
std::optional<Transfer> transferOfGama(std::string_view content, bool isRec709) {
  if (content.size() != 4) throw lengthError(content, "4");
  constexpr uint32_t kSrgb = 45455, kRounding = 5, kLinear = 100000;
  const uint32_t gamma = bigEndian(content, 0);
  if (gamma == 0) return std::nullopt; // "should be ignored"  [PNG 3, 11.3.2.2]
  if (gamma >= kSrgb - kRounding && gamma <= kSrgb + kRounding && isRec709)
    return Transfer{Transfer::Curve::srgb};
  if (gamma == kLinear) return Transfer{Transfer::Curve::linear};
  const double exponent = 1e5 / gamma;
  if (!(exponent >= 0.1 && exponent <= 10)) throw Error::mismatch("10000 to 1000000", std::to_string(gamma));
  return Transfer{Transfer::Curve::gamma, exponent};
}

// Primaries by cHRM: white, red, green, blue, stored times 100000.
Primaries primariesOfChrm(std::string_view content) {
  if (content.size() != 32) throw lengthError(content, "32");
  std::array<Chromaticity, 4> points;
  for (size_t i = 0; i < points.size(); ++i)
    points[i] = {bigEndian(content, 8 * i) / 1e5, bigEndian(content, 8 * i + 4) / 1e5};
  const Primaries primaries{points[1], points[2], points[3], points[0]};
  xyzFromRgb(primaries); // throws if they are invalid
  return primaries;
}

} // namespace

bool hasPngChunk(std::string_view file, std::string_view name) {
  bool found = false;
  forChunks(file, [&](const Chunk& chunk) {
    found = chunk.name() == name;
    return !found && chunk.name() != "IDAT";
  });
  return found;
}

std::optional<ColorStatement> pngColorStatement(std::string_view file) {
  std::map<std::string_view, Chunk> chunks; // the first of each name
  forChunks(file, [&](const Chunk& chunk) {
    const std::string_view name = chunk.name();
    if (name == "cICP" || name == "iCCP" || name == "sRGB" || name == "gAMA" || name == "cHRM")
      chunks.try_emplace(name, chunk);
    return name != "IDAT";
  });
  const bool isColor = file.size() > 25 && (file[25] & 2) != 0; // colour type of IHDR
  const auto has = [&](const char* name) { return chunks.contains(name); };
  const auto content = [&](const char* name) { return chunks.at(name).content(); };
  const auto stated = [&](const std::string& source, const auto& read) {
    ColorStatement statement{"PNG " + source + " chunk", {}, {}};
    try {
      statement.encoding = read();
    } catch (const Error& e) {
      statement.problem = e.what();
    }
    return statement;
  };
  const auto saysNothing = [](const ColorStatement& statement) { // neutral values: cICP of 2 and 2, gAMA of 0
    return statement.problem.empty() && !statement.encoding.transfer && !statement.encoding.primaries;
  };
  if (has("cICP"))
    if (auto statement = stated("cICP", [&] { return encodingOfCicp(content("cICP")); });
        !saysNothing(statement))
      return statement;
  if (has("iCCP"))
    return stated("iCCP", [&]() -> ColorEncoding {
      return {{}, {}, std::make_shared<IccTransform>(profileOf(content("iCCP")), isColor ? 3 : 1)};
    });
  if (has("sRGB"))
    return stated("sRGB", [&]() -> ColorEncoding {
      content("sRGB"); // throws if it is damaged
      return {Transfer{Transfer::Curve::srgb}, kRec709, nullptr};
    });
  if (!has("gAMA") && !has("cHRM")) return std::nullopt;
  const ColorStatement statement = stated(has("gAMA") ? "gAMA" : "cHRM", [&] {
    ColorEncoding encoding;
    if (has("cHRM")) encoding.primaries = primariesOfChrm(content("cHRM"));
    if (has("gAMA"))
      encoding.transfer =
          transferOfGama(content("gAMA"), !encoding.primaries || isRec709(*encoding.primaries));
    return encoding;
  });
  return saysNothing(statement) ? std::nullopt : std::optional(statement);
}

} // namespace surflect::image

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

namespace {

// Format of a file that is not a PNG, by its first bytes: ", but a JPEG"; empty if it is unknown.
std::string kindOf(std::string_view start) {
  using namespace std::string_view_literals;
  constexpr std::array<std::pair<std::string_view, const char*>, 8> kKinds{{{"\xff\xd8\xff"sv, "JPEG"},
                                                                            {"\x76\x2f\x31\x01"sv, "OpenEXR"},
                                                                            {"RIFF"sv, "WebP"},
                                                                            {"GIF8"sv, "GIF"},
                                                                            {"II*\0"sv, "TIFF"},
                                                                            {"MM\0*"sv, "TIFF"},
                                                                            {"#?"sv, "Radiance"},
                                                                            {"BM"sv, "BMP"}}};
  for (const auto& [magic, name] : kKinds)
    if (start.starts_with(magic)) return std::string(", but ") + name;
  return "";
}

} // namespace

PngHeader readPngHeader(const std::filesystem::path& path) {
  constexpr size_t kUsually = size_t{1} << 16, kDepth = 24,
                   kColorType = 25; // offsets of IHDR's fields in the file
  std::string start = readFileStart(path, kUsually);
  const auto* head = reinterpret_cast<const png_byte*>(start.data());
  if (start.size() <= kColorType || png_sig_cmp(head, 0, 8) != 0)
    throw Error("cannot read (not a PNG file" + kindOf(start) + ")").in(path);
  const uint32_t width = png_get_uint_32(head + 16), height = png_get_uint_32(head + 20);
  if (width < 1 || height < 1 || int64_t{width} * height > kMostPixels)
    throw Error::mismatch("at most 2^28 pixels", sizeText(width, height)).in(path);
  if (!hasPngChunk(start, "IDAT")) start = readFile(path);
  return {static_cast<int>(width), static_cast<int>(height),
          (start[kColorType] & PNG_COLOR_MASK_ALPHA) != 0 || hasPngChunk(start, "tRNS"),
          start[kDepth] == 16 ? 16 : 8, pngColorStatement(start)};
}

} // namespace surflect::image
