// OpenEXR files: many layers of one picture, read and written in one pass.
//
// A channel is named as in the file, "R" or "ViewLayer.Combined_L00.R". In a file of several parts its full
// name begins with its part's, "specular.R"; the name inside the part is understood too and then means the
// first part that has it.
#pragma once

#include "srf/image/color_encoding.h"
#include "srf/image/image.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::image {

// Channels that become one image, in this order.
using ChannelSet = std::vector<std::string>;

// An open file; only its header has been read. One thread at a time.
class ExrFile {
public:
  // Throws Error where the file is missing, damaged, incomplete, deep or larger than 2^28 pixels.
  explicit ExrFile(std::filesystem::path path);
  ~ExrFile();
  ExrFile(ExrFile&&) noexcept;

  const std::filesystem::path& path() const { return path_; }
  // Of the display window.
  int width() const { return width_; }
  int height() const { return height_; }
  const std::vector<std::string>& channels() const { return channels_; }
  bool has(const std::string& channel) const;
  // Metadata, of the first part; empty where there is no text of that name.
  std::optional<std::string> attribute(const std::string& name) const;
  // By the attribute `chromaticities`; none: Rec. 709's. Values are linear.
  std::optional<ColorStatement> colorStatement() const;

  // One image a set, of the display window: zero where the data window does not reach. Half and integer
  // samples become float. Every chunk of the file is decompressed once, whatever the number of sets. Throws
  // Error for an unknown channel, naming it, for damaged pixels and for more of them than the file has bytes
  // for; and Cancelled.
  std::vector<Image> read(std::span<const ChannelSet> sets, const Progress& progress = {}) const;
  Image read(const ChannelSet& set) const;

private:
  void checkClaim(std::span<const ChannelSet> sets) const;

  struct Parts;
  std::filesystem::path path_;
  std::unique_ptr<Parts> parts_;
  int width_ = 0, height_ = 0;
  std::vector<std::string> channels_;
};

// The channels that hold a layer's colour: R, G, B, or Y without X, Z, RY and BY. Throws Error that says what
// is there instead. And its alpha (A), where there is one. The empty layer is the picture itself.
ChannelSet colorChannels(const ExrFile& file, const std::string& layer);
std::optional<std::string> alphaChannel(const ExrFile& file, const std::string& layer);

enum class Precision { half, single };

// What a file of this precision keeps of values.
void roundTo(Precision precision, std::span<float> values);

// An image, and the channels it is written to.
struct ExrLayer {
  ChannelSet channels; // one per channel of the image
  const Image* image = nullptr;
  Precision precision = Precision::half; // half keeps 11 bits; values beyond +-65504 are clamped to that
  const Image* factor = nullptr;         // of one channel: the image is written times this
  float least = -std::numeric_limits<float>::infinity(); // what is below is written as this
};

// Threads of OpenEXR's pool, which belongs to the process and decompresses what is read; 0, as it begins,
// leaves that to the caller's thread. Not while pictures are read. Throws std::system_error.
void setExrThreads(int threads);

// The bytes of a file of layers of one size, with metadata; the same for the same input and any number of
// threads. Compressed by ZIP, which is lossless. Colours are those of Rec. 709, as the attribute
// `chromaticities` says. Needs memory for the file and, for each thread, 16 lines of pixels. Throws Error and
// Cancelled.
std::string exrBytes(std::span<const ExrLayer> layers, const std::map<std::string, std::string>& attributes,
                     const Progress& progress = {});

// Writes such a file, atomically.
void writeExr(const std::filesystem::path& path, std::span<const ExrLayer> layers,
              const std::map<std::string, std::string>& attributes = {}, const Progress& progress = {});
// One image of 1 to 4 channels as Y, YA, RGB or RGBA.
void writeExr(const std::filesystem::path& path, const Image& image, Precision precision = Precision::half);

} // namespace surflect::image
