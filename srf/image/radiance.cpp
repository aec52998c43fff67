// [Ward] G. Ward: Radiance file formats, "Picture Files"; Real Pixels, Graphics Gems II, 1991: the bytes of a
// pixel.
#include "srf/image/radiance.h"

#include "srf/image/image.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <string>
#include <vector>

namespace surflect::image {

namespace {

// Limits of memory relative to the file's size; masks of one colour are packed densely.
constexpr int64_t densest = 1 << 12;       // bytes of floats per byte of file
constexpr int64_t alwaysGranted = 1 << 29; // bytes, however small the file

using Pixel = std::array<uint8_t, 4>;

// Header lines; they end with a line feed, possibly after a carriage return.
class Lines {
public:
  explicit Lines(std::string_view file) : file_(file) {}

  std::string_view next() {
    const size_t end = file_.find('\n', at_);
    if (end == file_.npos || ++count_ > kMostLines) throw Error("the header has no end");
    std::string_view line = file_.substr(at_, end - at_);
    at_ = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }
  size_t place() const { return at_; }

private:
  static constexpr size_t kMostLines = 1 << 12;
  std::string_view file_;
  size_t at_ = 0, count_ = 0;
};

// Exactly `count` numbers, separated by blanks.
std::vector<double> numbersIn(std::string_view text, size_t count) {
  const auto wrong = [&] {
    return Error::mismatch(count == 1 ? "a number" : std::to_string(count) + " numbers",
                           "'" + std::string(text) + "'");
  };
  std::vector<double> numbers;
  std::string_view rest = text;
  for (;;) {
    rest.remove_prefix(std::min(rest.find_first_not_of(" \t"), rest.size()));
    if (rest.empty()) break;
    double number = 0;
    const auto [end, failure] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    if (failure != std::errc() || numbers.size() == count) throw wrong();
    numbers.push_back(number);
    rest.remove_prefix(static_cast<size_t>(end - rest.data()));
  }
  if (numbers.size() != count) throw wrong();
  return numbers;
}

// Divides out factors by which pixels have been multiplied; lines accumulate.
void divideOut(RadianceHeader& header, std::string_view text, size_t count) {
  const std::vector<double> factors = numbersIn(text, count);
  for (size_t c = 0; c < 3; ++c) {
    const double by = factors[count == 1 ? 0 : c];
    if (!(by > 0 && std::isfinite(by)))
      throw Error::mismatch("a number above 0", "'" + std::string(text) + "'");
    header.factor[c] /= by;
    if (!(header.factor[c] > 0 && std::isfinite(header.factor[c])))
      throw Error::mismatch("a product within double", "none");
  }
}

int sideOf(std::string_view text) {
  const double side = numbersIn(text, 1)[0];
  if (!(side >= 1 && side <= kMostSide && side == std::floor(side)))
    throw Error::mismatch("1 to 65536", numberText(side)).at("size");
  return static_cast<int>(side);
}

// Orientation "-Y 2 +X 4": sign, axis and number of scanlines, then of pixels in a scanline.
void readOrientation(RadianceHeader& header, std::string_view line) {
  const size_t second = line.find_first_of("XY", 2);
  const bool known =
      line.size() > 2 && second != line.npos && (line[1] == 'X' || line[1] == 'Y') && line[1] != line[second];
  const auto isSign = [](char c) { return c == '+' || c == '-'; };
  if (!known || !isSign(line[0]) || !isSign(line[second - 1]))
    throw Error::mismatch("an orientation such as '-Y 2 +X 4'", "'" + std::string(line) + "'");
  header.columns = line[1] == 'X';
  header.upwards = line[header.columns ? second - 1 : 0] == '+';
  header.leftwards = line[header.columns ? 0 : second - 1] == '-';
  const int first = sideOf(line.substr(2, second - 3)), last = sideOf(line.substr(second + 1));
  header.width = header.columns ? first : last;
  header.height = header.columns ? last : first;
  if (int64_t{header.width} * header.height > kMostPixels)
    throw Error::mismatch("at most 2^28 pixels", std::string(line));
}

// Statement of red, green, blue and white.
ColorStatement statedBy(std::string_view text) {
  ColorStatement statement{"Radiance PRIMARIES", {Transfer{}, {}, nullptr}, {}};
  try {
    const std::vector<double> xy = numbersIn(text, 8);
    const Primaries primaries{{xy[0], xy[1]}, {xy[2], xy[3]}, {xy[4], xy[5]}, {xy[6], xy[7]}};
    xyzFromRgb(primaries); // throws if they are invalid
    statement.encoding.primaries = primaries;
  } catch (const Error& e) {
    statement.problem = e.what();
  }
  return statement;
}

// ---------------------------------------------------------------------------------------------------------
// Pixels.

class ByteReader {
public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  uint8_t next() {
    if (rest_.empty()) throw Error("cannot read (the file is truncated)");
    const auto byte = static_cast<uint8_t>(rest_[0]);
    rest_.remove_prefix(1);
    return byte;
  }
  Pixel nextPixel() {
    Pixel pixel;
    for (uint8_t& byte : pixel) byte = next();
    return pixel;
  }
  // "New" scanlines store each byte plane separately, run-length encoded; they begin with 2, 2 and their
  // length.
  bool beginsPlanes(size_t length) const {
    const auto at = [&](size_t i) { return static_cast<uint8_t>(rest_[i]); };
    return rest_.size() >= 4 && length >= 8 && length < 32768 && at(0) == 2 && at(1) == 2 &&
           bigEndian(rest_, 2, 2) == length;
  }

private:
  std::string_view rest_;
};

void readPlanes(ByteReader& bytes, std::span<Pixel> scanline) {
  bytes.nextPixel(); // skips the marker
  for (size_t c = 0; c < 4; ++c)
    for (size_t x = 0; x < scanline.size();) {
      const uint8_t code = bytes.next(); // above 128: a run of code - 128 equal bytes
      const bool isRun = code > 128;
      const size_t count = isRun ? code - 128u : code;
      if (count == 0 || count > scanline.size() - x) throw Error("cannot read (a run leaves its scanline)");
      const uint8_t repeated = isRun ? bytes.next() : uint8_t{};
      for (const size_t end = x + count; x < end; ++x) scanline[x][c] = isRun ? repeated : bytes.next();
    }
}

// Pixels one after the other. Mantissas 1, 1, 1 repeat the previous pixel `exponent` times, and 256 times as
// often for each successive repetition.
void readPixels(ByteReader& bytes, std::span<Pixel> scanline) {
  int shift = 0;
  for (size_t x = 0; x < scanline.size();) {
    const Pixel pixel = bytes.nextPixel();
    if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
      scanline[x++] = pixel;
      shift = 0;
      continue;
    }
    const size_t count = shift < 24 ? size_t{pixel[3]} << shift : 0;
    if (x == 0 || count > scanline.size() - x) throw Error("cannot read (a run leaves its scanline)");
    std::fill_n(scanline.begin() + static_cast<std::ptrdiff_t>(x), count, scanline[x - 1]);
    x += count;
    shift += 8;
  }
}

// Mantissa / 256 * 2^(exponent - 128); an exponent of 0 is black.  [Ward 1991]
float valueOf(uint8_t mantissa, uint8_t exponent) {
  return exponent == 0 ? 0 : std::ldexp(static_cast<float>(mantissa), exponent - (128 + 8));
}

} // namespace

RadianceHeader radianceHeader(std::string_view file) {
  if (!file.starts_with("#?")) throw Error("cannot read (not a Radiance picture)");
  Lines lines(file);
  RadianceHeader header;
  std::string format = "32-bit_rle_rgbe"; // default
  lines.next();
  for (std::string_view line = lines.next(); !line.empty(); line = lines.next()) {
    const size_t sign = line.find('=');
    if (sign == line.npos || line.starts_with('#')) continue;
    const std::string key(line.substr(0, sign));
    const std::string_view value = line.substr(sign + 1);
    try {
      if (key == "FORMAT") format = value.substr(std::min(value.find_first_not_of(' '), value.size()));
      if (key == "EXPOSURE") divideOut(header, value, 1);
      if (key == "COLORCORR") divideOut(header, value, 3);
      if (key == "GAMMA" && numbersIn(value, 1)[0] != 1) // not Radiance's own key, but written by rgbe.c
        throw Error::mismatch("1", "'" + std::string(value) + "'");
    } catch (Error& e) {
      throw std::move(e).at(key);
    }
    if (key == "PRIMARIES") header.color = statedBy(value);
  }
  header.isXyz = format == "32-bit_rle_xyze";
  if (header.isXyz)
    header.color = ColorStatement{"Radiance XYZE", {Transfer{}, kRec709, nullptr}, {}};
  else if (format != "32-bit_rle_rgbe")
    throw Error::mismatch("32-bit_rle_rgbe or 32-bit_rle_xyze", "'" + format + "'").at("FORMAT");
  readOrientation(header, lines.next());
  header.bytes = lines.place();
  return header;
}

RadiancePicture readRadiance(const std::filesystem::path& path) try {
  const std::string file = readFile(path);
  RadiancePicture picture{radianceHeader(file), {}};
  const RadianceHeader& header = picture.header;
  const int64_t claimed = int64_t{header.width} * header.height * 3 * int64_t{sizeof(float)};
  if (claimed > std::max(alwaysGranted, densest * static_cast<int64_t>(file.size())))
    throw Error::mismatch("at least " + std::to_string(claimed / densest) + " bytes for so many pixels",
                          std::to_string(file.size()) + " bytes");
  picture.image = Image(header.width, header.height, 3);
  ByteReader bytes(std::string_view(file).substr(header.bytes));
  const Mat3<float> rec709FromXyz = xyzFromRgb(kRec709).inverse().cast<float>();
  const int scanlines = header.columns ? header.width : header.height;
  std::vector<Pixel> scanline(static_cast<size_t>(header.columns ? header.height : header.width));
  for (int line = 0; line < scanlines; ++line) {
    bytes.beginsPlanes(scanline.size()) ? readPlanes(bytes, scanline) : readPixels(bytes, scanline);
    for (int i = 0; i < static_cast<int>(scanline.size()); ++i) {
      const int across = header.columns ? line : i, down = header.columns ? i : line;
      const auto texel = picture.image.at(header.leftwards ? header.width - 1 - across : across,
                                          header.upwards ? header.height - 1 - down : down);
      const Pixel& pixel = scanline[static_cast<size_t>(i)];
      for (size_t c = 0; c < 3; ++c)
        texel[c] = static_cast<float>(header.factor[c]) * valueOf(pixel[c], pixel[3]);
      if (header.isXyz) {
        Eigen::Map<Vec3<float>> color(texel.data());
        color = (rec709FromXyz * color).eval();
      }
    }
  }
  return picture;
} catch (Error& e) {
  throw std::move(e).in(path);
}

} // namespace surflect::image
