#include "srf/image/exr.h"

#include "srf/image/image.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfIntAttribute.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <ImfVersion.h>
#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unistd.h>
#include <utility>
#include <vector>

namespace surflect::image {

// [OpenEXR] OpenEXR File Layout: after magic number and version, each header is a list of attributes (name,
// type, size, value) that ends with an empty name; a file of several parts ends its list of headers with an
// empty one. Texts end with a zero byte, numbers are little-endian.
namespace {

const std::map<std::string_view, int64_t> kSizes = {{"box2f", 16},
                                                    {"box2i", 16},
                                                    {"chromaticities", 32},
                                                    {"compression", 1},
                                                    {"deepImageState", 1},
                                                    {"double", 8},
                                                    {"envmap", 1},
                                                    {"float", 4},
                                                    {"int", 4},
                                                    {"keycode", 28},
                                                    {"lineOrder", 1},
                                                    {"m33d", 72},
                                                    {"m33f", 36},
                                                    {"m44d", 128},
                                                    {"m44f", 64},
                                                    {"rational", 8},
                                                    {"tiledesc", 9},
                                                    {"timecode", 8},
                                                    {"v2d", 16},
                                                    {"v2f", 8},
                                                    {"v2i", 8},
                                                    {"v3d", 24},
                                                    {"v3f", 12},
                                                    {"v3i", 12}};

// End of the channel list that begins with `value`: each entry is a name and 16 bytes, the last name is
// empty.
std::optional<int64_t> endOfChannels(std::string_view value) {
  for (size_t at = 0; at < value.size();) {
    const size_t end = value.find('\0', at);
    if (end == value.npos) return std::nullopt;
    if (end == at) return static_cast<int64_t>(end + 1);
    at = end + 1 + 16;
  }
  return std::nullopt;
}

// End of the last text; each text is preceded by its length.
std::optional<int64_t> endOfTexts(std::string_view value) {
  size_t at = 0;
  while (at + 4 <= value.size()) at += 4 + size_t{littleEndian(value, at)};
  return static_cast<int64_t>(at);
}

// Size of a preview: width and height, then pixels of 4 bytes.
int64_t sizeOfPreview(std::string_view value) {
  if (value.size() < 8) return 8;
  constexpr int64_t kMostSide = int64_t{1} << 24;
  return 8 + 4 * std::min<int64_t>(littleEndian(value, 0), kMostSide) *
                 std::min<int64_t>(littleEndian(value, 4), kMostSide);
}

// Size that the type requires; empty if any size is valid, or none.
std::optional<int64_t> sizeOf(std::string_view type, std::string_view value) {
  if (const auto found = kSizes.find(type); found != kSizes.end()) return found->second;
  if (type == "chlist") return endOfChannels(value).value_or(-1);
  if (type == "stringvector") return endOfTexts(value);
  if (type == "preview") return sizeOfPreview(value);
  return std::nullopt;
}

} // namespace

void requireHonestAttributes(const std::filesystem::path& path) {
  constexpr int64_t kLongestWord = 255;
  std::ifstream in(path, std::ios::binary);
  const auto bytes = static_cast<int64_t>(std::filesystem::file_size(path));
  std::array<char, 8> magicAndVersion{};
  in.read(magicAndVersion.data(), magicAndVersion.size());
  if (!in || !Imf::isImfMagic(magicAndVersion.data())) return;
  const auto word = [&]() -> std::optional<std::string> {
    std::array<char, kLongestWord + 1> text;
    if (!in.getline(text.data(), text.size(), '\0')) return std::nullopt;
    return text.data();
  };
  constexpr unsigned kIsMultiPart = 0x10; // in the second byte of the version
  const bool hasSeveralHeaders = static_cast<unsigned char>(magicAndVersion[5]) & kIsMultiPart;
  for (bool isLast = false; !isLast;) {
    isLast = true; // true unless it is a non-empty header of several
    for (auto name = word(); name && !name->empty(); name = word()) {
      isLast = !hasSeveralHeaders;
      const auto type = word();
      std::array<char, 4> size{};
      if (!type || !in.read(size.data(), size.size())) return;
      const int64_t length = littleEndian({size.data(), size.size()}, 0), left = bytes - in.tellg();
      const auto refuse = [&](const std::string& expected) {
        throw Error::mismatch(expected, std::to_string(length) + " bytes of " + *type).at(*name).in(path);
      };
      if (length > left) refuse("at most the " + std::to_string(left) + " that are left of the file");
      std::string value(static_cast<size_t>(length), '\0');
      in.read(value.data(), length);
      const auto expected = sizeOf(*type, value);
      if (expected && *expected != length)
        refuse(*expected < 0 ? "an end of the list in them" : std::to_string(*expected) + " bytes");
    }
  }
}

namespace {

// Message of OpenEXR without the file name in quotes at its beginning, which Error already has.
std::string problemOf(const std::exception& e) {
  std::string text = e.what();
  if (const size_t quote = text.rfind("\". "); quote != std::string::npos) text.erase(0, quote + 3);
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

template <class Work>
auto translatingErrors(const std::filesystem::path& path, const char* action, Work work) {
  try {
    return work();
  } catch (const Error&) {
    throw;
  } catch (const Cancelled&) {
    throw;
  } catch (const std::exception& e) {
    throw Error("cannot " + std::string(action) + " (" + problemOf(e) + ")").in(path);
  }
}

// Bounds the sizes that a header may claim, because OpenEXR allocates by them.
void boundHeaders() {
  static const bool bounded = [] {
    Imf::Header::setMaxImageSize(kMostSide, kMostSide);
    Imf::Header::setMaxTileSize(kMostSide, kMostSide);
    return true;
  }();
  (void)bounded;
}

// Largest number of pixel bytes that one byte of file can hold: an uncompressed float is four times a sample
// of 8 bits. DWA quantises whole blocks away.
int64_t densestOf(Imf::Compression compression) {
  const bool isDwa = compression == Imf::DWAA_COMPRESSION || compression == Imf::DWAB_COMPRESSION;
  return isDwa ? 1 << 16 : 2 * 1032; // deflate, times half to float
}
// Memory that any file may use, however small: data windows can be small parts of empty pictures.
constexpr int64_t kGrantedExrBytes = int64_t{1} << 28; // bytes

struct ChannelPlace {
  int part = 0;
  std::string name; // inside the part

  friend auto operator<=>(const ChannelPlace&, const ChannelPlace&) = default;
};

bool isFlat(const Imf::Header& header) {
  return !header.hasType() || header.type() == Imf::SCANLINEIMAGE || header.type() == Imf::TILEDIMAGE;
}

std::string inLayer(const std::string& layer, const char* channel) {
  return layer.empty() ? channel : layer + "." + channel;
}

// Layer of a channel, "" or "ViewLayer.Combined", and its name there.
std::pair<std::string, std::string> layerAndName(const std::string& channel) {
  const size_t dot = channel.rfind('.');
  return dot == channel.npos ? std::pair(std::string(), channel)
                             : std::pair(channel.substr(0, dot), channel.substr(dot + 1));
}

// Channels of one layer in one part.
struct PartOfLayer {
  int part = 0;
  std::string partName;
  std::set<std::string> names;

  bool hasRgb() const { return names.contains("R") && names.contains("G") && names.contains("B"); }
  bool hasGray() const {
    return names.contains("Y") && !names.contains("X") && !names.contains("Z") && !names.contains("RY") &&
           !names.contains("BY");
  }
  bool hasAlpha() const { return names.contains("A"); }
  bool isCalledBeauty() const {
    constexpr std::array<std::string_view, 7> kNames = {"beauty", "rgba",     "rgb", "color",
                                                        "colour", "combined", "main"};
    return std::ranges::find(kNames, std::string_view(lowerCase(partName))) != kNames.end();
  }
};

// The part that shows a layer; none if several do and neither name nor alpha tells which.
std::optional<int> partThatShows(std::span<const PartOfLayer> parts) {
  std::vector<const PartOfLayer*> candidates;
  const auto keep = [](std::span<const PartOfLayer* const> from, bool (PartOfLayer::*holds)() const) {
    std::vector<const PartOfLayer*> kept;
    std::ranges::copy_if(from, std::back_inserter(kept),
                         [&](const PartOfLayer* part) { return (part->*holds)(); });
    return kept;
  };
  for (const PartOfLayer& part : parts) candidates.push_back(&part);
  for (const auto colors : {&PartOfLayer::hasRgb, &PartOfLayer::hasGray}) {
    const auto colored = keep(candidates, colors);
    if (colored.size() == 1) return colored[0]->part;
    if (colored.empty()) continue;
    for (const auto tells : {&PartOfLayer::isCalledBeauty, &PartOfLayer::hasAlpha})
      if (const auto told = keep(colored, tells); told.size() == 1) return told[0]->part;
    return std::nullopt;
  }
  return parts.front().part;
}

} // namespace

struct ExrFile::Parts {
  explicit Parts(const char* path) : file(path, /*numThreads=*/0, /*reconstructChunkOffsetTable=*/false) {}

  Imf::MultiPartInputFile file;
  std::map<std::string, ChannelPlace> places; // by full name, and by name inside the part
};

ExrFile::ExrFile(std::filesystem::path path) : path_(std::move(path)) {
  ::close(openForReading(path_)); // throws with the reason
  boundHeaders();
  translatingErrors(path_, "read", [this] {
    requireHonestAttributes(path_);
    parts_ = std::make_unique<Parts>(path_.c_str());
    const Imath::Box2i display = parts_->file.header(0).displayWindow();
    const int64_t width = int64_t{display.max.x} - display.min.x + 1;
    const int64_t height = int64_t{display.max.y} - display.min.y + 1;
    if (width < 1 || height < 1 || width > kMostSide || height > kMostSide || width * height > kMostPixels)
      throw Error::mismatch("at most 2^28 pixels", sizeText(width, height)).at("displayWindow").in(path_);
    width_ = static_cast<int>(width);
    height_ = static_cast<int>(height);

    const bool multiPart = parts_->file.parts() > 1;
    for (int part = 0; part < parts_->file.parts(); ++part) {
      const Imf::Header& header = parts_->file.header(part);
      if (!isFlat(header)) continue;
      if (!parts_->file.partComplete(part)) throw Error("the file is incomplete").in(path_);
      const std::string prefix = multiPart ? header.name() + "." : "";
      for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
        const std::string name = c.name();
        const std::string fullName = name.starts_with(prefix) ? name : prefix + name;
        if (!parts_->places.try_emplace(fullName, part, name).second) continue;
        channels_.push_back(fullName);
        if (c.channel().xSampling != 1 || c.channel().ySampling != 1)
          throw Error("subsampled channels are not supported").at(fullName).in(path_);
      }
    }
    // Full names come first, so that a bare name never hides one.
    std::map<std::string, std::vector<PartOfLayer>> partsOf; // by layer
    for (const std::string& fullName : channels_) {
      const ChannelPlace place = parts_->places.at(fullName);
      const auto [layer, name] = layerAndName(place.name);
      std::vector<PartOfLayer>& parts = partsOf[layer];
      if (parts.empty() || parts.back().part != place.part)
        parts.push_back({place.part, multiPart ? parts_->file.header(place.part).name() : "", {}});
      parts.back().names.insert(name);
    }
    std::map<std::string, std::optional<int>> shown;
    for (const auto& [layer, parts] : partsOf) shown[layer] = partThatShows(parts);
    const std::set<std::string> colorNames{"R", "G", "B", "A", "Y", "X", "Z", "RY", "BY"};
    for (const std::string& fullName : channels_) {
      const ChannelPlace place = parts_->places.at(fullName);
      const auto [layer, name] = layerAndName(place.name);
      if (colorNames.contains(name) && shown[layer] != place.part) continue;
      parts_->places.try_emplace(place.name, place);
    }
    for (int part = 0; multiPart && part < parts_->file.parts(); ++part)
      partNames_.push_back(parts_->file.header(part).name());
    if (const auto own = shown.find(""); multiPart && own != shown.end() && own->second)
      shownPart_ = parts_->file.header(*own->second).name();
    if (channels_.empty()) throw Error::mismatch("a flat picture", "deep samples only").in(path_);
  });
}

ExrFile::~ExrFile() = default;
ExrFile::ExrFile(ExrFile&&) noexcept = default;

bool ExrFile::has(const std::string& channel) const { return parts_->places.contains(channel); }

Precision ExrFile::precision(const std::string& channel) const {
  const ChannelPlace& place = parts_->places.at(channel);
  return parts_->file.header(place.part).channels()[place.name].type == Imf::HALF ? Precision::half
                                                                                  : Precision::single;
}

std::optional<std::string> ExrFile::attribute(const std::string& name) const {
  const auto* found = parts_->file.header(0).findTypedAttribute<Imf::StringAttribute>(name);
  return found ? std::optional(found->value()) : std::nullopt;
}

// [OpenEXR] "Technical Introduction", CIE x,y chromaticities: without the attribute, Rec. 709. All parts of a
// file have the same. [SMPTE ST 2065-4] an ACES container has ACES primaries.
std::optional<ColorStatement> ExrFile::colorStatement() const {
  const Imf::Header& header = parts_->file.header(0);
  ColorStatement statement{"EXR chromaticities", {Transfer{}, {}, nullptr}, {}};
  if (const auto* found = header.findTypedAttribute<Imf::ChromaticitiesAttribute>("chromaticities")) {
    const auto at = [](const Imath::V2f& xy) { return Chromaticity{xy.x, xy.y}; };
    const Imf::Chromaticities& c = found->value();
    statement.encoding.primaries = Primaries{at(c.red), at(c.green), at(c.blue), at(c.white)};
    try {
      xyzFromRgb(*statement.encoding.primaries);
    } catch (const Error& e) {
      statement.problem = e.what();
    }
    return statement;
  }
  if (!header.findTypedAttribute<Imf::IntAttribute>("acesImageContainerFlag")) return std::nullopt;
  statement.source = "EXR, ACES container";
  statement.encoding.primaries = kAces;
  return statement;
}

namespace {

// Destination of a decoded channel; several targets may use the same channel.
struct Target {
  Image* image;
  int plane;
};
using Targets = std::map<ChannelPlace, std::vector<Target>>;

// Decodes a band of rows of the data window at a time, and copies its part of the display window.
void readPart(Imf::MultiPartInputFile& file, int partIndex, const Targets& targets,
              const Progress& progress) {
  Imf::InputPart part(file, partIndex);
  const Imath::Box2i data = part.header().dataWindow(), display = part.header().displayWindow();
  const int firstX = std::max(data.min.x, display.min.x), lastX = std::min(data.max.x, display.max.x);
  const int firstY = std::max(data.min.y, display.min.y), lastY = std::min(data.max.y, display.max.y);
  constexpr int bandRows = 32; // OpenEXR keeps a larger chunk between calls

  const size_t width = static_cast<size_t>(int64_t{data.max.x} - data.min.x + 1);
  std::vector<float> band(width * bandRows);
  std::vector<std::vector<float>> planes;
  for (size_t i = 0; i < targets.size(); ++i) planes.push_back(band);

  for (int top = firstY; top <= lastY; top += bandRows) {
    progress.checkpoint();
    const int bottom = std::min(top + bandRows - 1, lastY);
    Imf::FrameBuffer frameBuffer;
    auto plane = planes.begin();
    for (const auto& [place, wanted] : targets)
      frameBuffer.insert(place.name,
                         Imf::Slice::Make(Imf::FLOAT, (plane++)->data(),
                                          Imath::Box2i({data.min.x, top}, {data.max.x, top + bandRows - 1})));
    part.setFrameBuffer(frameBuffer);
    part.readPixels(top, bottom);

    plane = planes.begin();
    for (const auto& [place, wanted] : targets) {
      for (int y = top; y <= bottom; ++y) {
        const float* row = plane->data() + static_cast<size_t>(y - top) * width;
        for (const Target& target : wanted)
          for (int x = firstX; x <= lastX; ++x)
            target.image->at(x - display.min.x, y - display.min.y)[static_cast<size_t>(target.plane)] =
                row[x - data.min.x];
      }
      ++plane;
    }
  }
}

} // namespace

// Refuses to allocate memory for pixels that the file has no bytes for.
void ExrFile::checkClaim(std::span<const ChannelSet> sets) const {
  int64_t channels = 0, densest = 0;
  for (const ChannelSet& set : sets) channels += static_cast<int64_t>(set.size());
  for (int part = 0; part < parts_->file.parts(); ++part)
    densest = std::max(densest, densestOf(parts_->file.header(part).compression()));
  const int64_t claimed = channels * width_ * height_ * int64_t{sizeof(float)};
  const auto fileBytes = static_cast<int64_t>(std::filesystem::file_size(path_));
  if (claimed > kGrantedExrBytes && claimed / densest > fileBytes)
    throw Error::mismatch("a file of at least " + std::to_string(claimed / densest) +
                              " bytes for so many pixels",
                          std::to_string(fileBytes))
        .in(path_);
}

std::vector<Image> ExrFile::read(std::span<const ChannelSet> sets, const Progress& progress) const {
  for (const ChannelSet& set : sets)
    for (const std::string& channel : set)
      if (!has(channel)) throw Error("the file has no such channel").at(channel).in(path_);

  checkClaim(sets);
  std::vector<Image> images;
  images.reserve(sets.size());
  std::map<int, Targets> targetsOfPart;
  for (const ChannelSet& set : sets) {
    Image& image = images.emplace_back(width_, height_, static_cast<int>(set.size()));
    for (int plane = 0; plane < image.channels; ++plane) {
      const ChannelPlace& place = parts_->places.at(set[static_cast<size_t>(plane)]);
      targetsOfPart[place.part][place].push_back({&image, plane});
    }
  }
  translatingErrors(path_, "read", [&] {
    for (const auto& [part, targets] : targetsOfPart) readPart(parts_->file, part, targets, progress);
  });
  return images;
}

void ExrFile::decode() const {
  std::map<int, std::string> firstOf; // a chunk has all channels of its part
  for (const std::string& channel : channels_) firstOf.try_emplace(parts_->places.at(channel).part, channel);
  for (const auto& [part, channel] : firstOf) read({channel});
}

Image ExrFile::read(const ChannelSet& set) const { return std::move(read(std::span(&set, 1)).front()); }

namespace {

// "ViewLayer.Combined.A, ViewLayer.Combined.B, ..": as many as a line takes.
std::string listed(const std::vector<std::string>& names) {
  constexpr size_t kMostShown = 12;
  std::string text;
  for (size_t i = 0; i < std::min(kMostShown, names.size()); ++i) text += (i > 0 ? ", " : "") + names[i];
  if (names.size() > kMostShown) text += " and " + std::to_string(names.size() - kMostShown) + " more";
  return text;
}

// Channels of the given names that the layer has.
std::vector<std::string> present(const ExrFile& file, const std::string& layer,
                                 std::initializer_list<const char*> names) {
  std::vector<std::string> found;
  for (const char* name : names)
    if (file.has(inLayer(layer, name))) found.emplace_back(name);
  return found;
}

// Y alone is gray. Beside X or Z it is a coordinate, beside RY or BY the luminance of a colour.
bool hasGray(const ExrFile& file, const std::string& layer) {
  return file.has(inLayer(layer, "Y")) && present(file, layer, {"X", "Z", "RY", "BY"}).empty();
}

bool hasColors(const ExrFile& file, const std::string& layer) {
  return present(file, layer, {"R", "G", "B"}).size() == 3 || hasGray(file, layer);
}

// Channels that a layer has instead of R, G, B or Y.
std::string foundInstead(const ExrFile& file, const std::string& layer) {
  if (!file.has(inLayer(layer, "Y"))) return listed(file.channels());
  if (!present(file, layer, {"X", "Z"}).empty())
    return listed(present(file, layer, {"X", "Y", "Z"})) + " (CIE XYZ, or a vector)";
  return listed(present(file, layer, {"Y", "RY", "BY"})) + " (luminance and chroma)";
}

// Layers that have colours, in alphabetical order.
std::vector<std::string> colorLayers(const ExrFile& file) {
  std::set<std::string> layers;
  for (const std::string& channel : file.channels())
    if (const size_t dot = channel.rfind('.'); dot != channel.npos && hasColors(file, channel.substr(0, dot)))
      layers.insert(channel.substr(0, dot));
  return {layers.begin(), layers.end()};
}

} // namespace

ChannelSet colorChannels(const ExrFile& file, const std::string& layer) {
  if (present(file, layer, {"R", "G", "B"}).size() == 3)
    return {inLayer(layer, "R"), inLayer(layer, "G"), inLayer(layer, "B")};
  if (hasGray(file, layer)) return {inLayer(layer, "Y")};
  const std::string what = layer.empty() ? "channels" : "layer " + layer;
  const std::vector<std::string> layers = colorLayers(file);
  const std::string hint = layers.empty() ? "" : " (or as `layer` of the frames: " + listed(layers) + ")";
  throw Error::mismatch("R, G, B or Y" + hint, foundInstead(file, layer)).at(what).in(file.path());
}

std::optional<std::string> alphaChannel(const ExrFile& file, const std::string& layer) {
  const std::string alpha = inLayer(layer, "A");
  return file.has(alpha) ? std::optional(alpha) : std::nullopt;
}

void setExrThreads(int threads) { Imf::setGlobalThreadCount(threads); }

} // namespace surflect::image
