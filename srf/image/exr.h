// OpenEXR files: many layers of one picture, read and written in one pass.
//
// Channel names are those of the file: "R" or "ViewLayer.Combined_L00.R". In a file of several parts the full
// name begins with the part's, "specular.R". Without part it means, for the colours and alpha of a layer, the
// one part that shows that layer: the only part with R, G and B, else with Y; of several, the only one called
// beauty, rgba, rgb, color, combined or main, else the only one with alpha; else none. Other names mean the
// first part that has the channel.
#pragma once

#include "srf/image/color.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <array>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace surflect::image {

// Checks the attributes in an OpenEXR header before the library reads them.

// The library allocates the stated size of an attribute before it reads, and reads as much as the attribute's
// type requires. Throws Error if an attribute is longer than the rest of the file, or its size does not fit
// its type. Other faults are left to the library.
void requireHonestAttributes(const std::filesystem::path& path);

// Channels that become one image, in this order.
using ChannelSet = std::vector<std::string>;

enum class Precision { half, single };

// An open file of which only the header has been read. For one thread at a time.
class ExrFile {
public:
  // Throws Error if the file is missing, damaged, incomplete, deep or larger than 2^28 pixels.
  explicit ExrFile(std::filesystem::path path);
  ~ExrFile();
  ExrFile(ExrFile&&) noexcept;

  const std::filesystem::path& path() const { return path_; }
  // Size of the display window.
  int width() const { return width_; }
  int height() const { return height_; }
  const std::vector<std::string>& channels() const { return channels_; }
  // Names of the parts, if there are several, in file order; and of the part that shows the picture itself.
  const std::vector<std::string>& parts() const { return partNames_; }
  const std::string& shownPart() const { return shownPart_; }
  bool has(const std::string& channel) const;
  // Precision of a channel that the file has; integers count as single.
  Precision precision(const std::string& channel) const;
  // Text metadata of the first part; empty if there is none of that name.
  std::optional<std::string> attribute(const std::string& name) const;
  // Colour statement by the attribute `chromaticities`; none: Rec. 709. Values are linear.
  std::optional<ColorStatement> colorStatement() const;

  // One image per set, of the display window's size; zero outside of the data window. Half and integer
  // samples become float. Each chunk of the file is decompressed once for all sets. Throws Error for an
  // unknown channel, with its name, for damaged pixels and for more pixels than the file has bytes for;
  // throws Cancelled.
  std::vector<Image> read(std::span<const ChannelSet> sets, const Progress& progress = {}) const;
  Image read(const ChannelSet& set) const;
  // Decompresses all chunks. Throws Error for damaged pixels.
  void decode() const;

private:
  void checkClaim(std::span<const ChannelSet> sets) const;

  struct Parts;
  std::filesystem::path path_;
  std::unique_ptr<Parts> parts_;
  int width_ = 0, height_ = 0;
  std::vector<std::string> channels_, partNames_;
  std::string shownPart_;
};

// Colour channels of a layer: R, G, B, or Y without X, Z, RY and BY. Throws Error that lists the channels
// there are. alphaChannel: its alpha (A), if any. The empty layer is the picture itself.
ChannelSet colorChannels(const ExrFile& file, const std::string& layer);
std::optional<std::string> alphaChannel(const ExrFile& file, const std::string& layer);

// Rounds values to a file's precision.
void roundTo(Precision precision, std::span<float> values);

// An image and the channels it is written to.
struct ExrLayer {
  ChannelSet channels; // one per channel of the image
  const Image* image = nullptr;
  Precision precision = Precision::half;                 // half keeps 11 bits; values are clamped to +-65504
  const Image* factor = nullptr;                         // one channel; the image is multiplied by it
  float least = -std::numeric_limits<float>::infinity(); // smaller values are written as this
};

// Sets the number of threads of OpenEXR's process-wide pool, which decompresses. 0, the default, decompresses
// in the caller's thread. Must not be called while pictures are read. Throws std::system_error.
void setExrThreads(int threads);

// Value of an attribute in a file's header.

struct FrameRate { // frames per second
  int numerator, denominator;
};
using RowMatrix = std::array<std::array<float, 4>, 4>; // acts on rows from the right: (x y z 1) M
using Pair = std::array<float, 2>;
using ExrAttribute = std::variant<std::string, int, float, FrameRate, Pair, RowMatrix>;
using ExrAttributes = std::map<std::string, ExrAttribute>;

// Bytes of a file with layers of one size and metadata; the same for equal input and any number of threads.
// Compressed losslessly by ZIP. The attribute `chromaticities` states Rec. 709. Needs memory for the file and
// 16 lines of pixels per thread. Throws Error and Cancelled.
std::string exrBytes(std::span<const ExrLayer> layers, const ExrAttributes& attributes,
                     const Progress& progress = {});

// Writes exrBytes() to a file, atomically.
void writeExr(const std::filesystem::path& path, std::span<const ExrLayer> layers,
              const ExrAttributes& attributes = {}, const Progress& progress = {});
// One image of 1 to 4 channels as Y, YA, RGB or RGBA.
void writeExr(const std::filesystem::path& path, const Image& image, Precision precision = Precision::half);

} // namespace surflect::image
