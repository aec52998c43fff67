// [PNG 3] Portable Network Graphics Specification, third edition: 4.3 the order of precedence, 5.3 chunks,
// 11.3.2 cHRM, gAMA, iCCP, sRGB and cICP. [H.273] the code points of cICP. Read here rather than by libpng,
// which drops a damaged chunk with a warning and does not know cICP.
#include "srf/image/png_color.h"

#include "srf/image/icc.h"
#include "surfel/base/endian.h"
#include "surfel/base/error.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>

namespace surflect::image {

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
