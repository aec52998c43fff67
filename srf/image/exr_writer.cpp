// Scan line files, written as by the OpenEXR library except for the deflate streams of their chunks.
//   [OpenEXR File Layout] Magic number, version, header, offsets of the chunks, chunks of 16 lines each.
#include "srf/image/deflate.h"
#include "srf/image/exr.h"
#include "srf/image/half_float.h"
#include "surfel/base/file.h"

#include <ImfChannelList.h>
#include <ImfCompression.h>
#include <ImfFloatAttribute.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfRationalAttribute.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <half.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstring>
#include <memory>
#include <utility>

namespace surflect::image {

namespace {

constexpr int kLinesOfChunk = 16; // of ZIP compression

// One channel of a layer. Chunks hold channels in the order of their names.
struct Plane {
  const ExrLayer* layer;
  size_t channel;

  bool isHalf() const { return layer->precision == Precision::half; }
  size_t sampleBytes() const { return isHalf() ? sizeof(uint16_t) : sizeof(float); }
};
using Planes = std::map<std::string, Plane>;

Planes planesOf(std::span<const ExrLayer> layers) {
  Planes planes;
  for (const ExrLayer& layer : layers) {
    assert(layer.channels.size() == static_cast<size_t>(layer.image->channels));
    assert(!layer.factor || layer.factor->channels == 1);
    for (size_t channel = 0; channel < layer.channels.size(); ++channel)
      planes[layer.channels[channel]] = {&layer, channel};
  }
  return planes;
}

class MemoryStream : public Imf::OStream {
public:
  MemoryStream() : Imf::OStream("") {}

  void write(const char bytes[], int count) override { bytes_.append(bytes, static_cast<size_t>(count)); }
  uint64_t tellp() override { return bytes_.size(); }
  void seekp(uint64_t) override { assert(false && "headers are written in one go"); }

  const std::string& bytes() const { return bytes_; }

private:
  std::string bytes_;
};

template <class T> void append(std::string& to, T value) {
  static_assert(std::endian::native == std::endian::little);
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Attributes of the library's types.
Imf::StringAttribute foreign(const std::string& text) { return {text}; }
Imf::IntAttribute foreign(int number) { return {number}; }
Imf::FloatAttribute foreign(float number) { return {number}; }
Imf::RationalAttribute foreign(FrameRate rate) { return {{rate.numerator, rate.denominator}}; }
Imf::V2fAttribute foreign(const Pair& pair) { return {Imath::V2f(pair[0], pair[1])}; }
Imf::M44fAttribute foreign(const RowMatrix& matrix) {
  Imath::M44f copy;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      copy[row][column] = matrix[static_cast<size_t>(row)][static_cast<size_t>(column)];
  return {copy};
}

// Magic number, version and attributes.
std::string headOf(const Planes& planes, const ExrAttributes& attributes, const Image& picture) {
  constexpr size_t kLongestShortName = 31;
  constexpr int32_t kMagic = 20000630, kVersion = 2, kHasLongNames = 0x400;
  Imf::Header header(picture.width, picture.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::addChromaticities(header, Imf::Chromaticities()); // Rec. 709's
  bool hasLongNames = false;
  for (const auto& [name, plane] : planes) {
    header.channels().insert(name, Imf::Channel(plane.isHalf() ? Imf::HALF : Imf::FLOAT));
    hasLongNames |= name.size() > kLongestShortName;
  }
  for (const auto& [key, value] : attributes) {
    std::visit([&](const auto& of) { header.insert(key, foreign(of)); }, value);
    hasLongNames |= key.size() > kLongestShortName;
  }
  MemoryStream stream;
  header.writeTo(stream);
  std::string head;
  append(head, kMagic);
  append(head, kVersion | (hasLongNames ? kHasLongNames : 0));
  return head + stream.bytes();
}

// Every `stride`-th float; a constant stride lets the compiler vectorise the loop.
template <size_t stride> void pick(const float* from, std::span<float> to) {
  for (size_t i = 0; i < to.size(); ++i) to[i] = from[i * stride];
}

// Samples of a plane in one line.
void gatherLine(const Plane& plane, int y, std::span<float> line) {
  const ExrLayer& layer = *plane.layer;
  const float* from = layer.image->at(0, y).data() + plane.channel;
  const auto stride = static_cast<size_t>(layer.image->channels);
  if (stride == 1)
    pick<1>(from, line);
  else if (stride == 3)
    pick<3>(from, line);
  else if (stride == 4)
    pick<4>(from, line);
  else
    for (size_t x = 0; x < line.size(); ++x) line[x] = from[x * stride];
  if (layer.factor) {
    const float* factor = layer.factor->at(0, y).data();
    for (size_t x = 0; x < line.size(); ++x) line[x] *= factor[x];
  }
  for (float& value : line) value = value < layer.least ? layer.least : value;
}

// Uninitialised memory, all of which is written before it is read.
struct Bytes {
  explicit Bytes(size_t count) : size(count), data(std::make_unique_for_overwrite<std::byte[]>(count)) {}

  size_t size;
  std::unique_ptr<std::byte[]> data;
};

// Lines [first, end) of all planes, not compressed.
Bytes samplesOf(const Planes& planes, int first, int end) {
  size_t pixelBytes = 0;
  for (const auto& [name, plane] : planes) pixelBytes += plane.sampleBytes();
  const auto width = static_cast<size_t>(planes.begin()->second.layer->image->width);
  Bytes samples(pixelBytes * width * static_cast<size_t>(end - first));
  std::byte* to = samples.data.get();
  std::vector<float> line(width);
  std::vector<uint16_t> halves(width);
  for (int y = first; y < end; ++y)
    for (const auto& [name, plane] : planes) {
      gatherLine(plane, y, line);
      if (plane.isHalf()) std::ranges::transform(line, halves.begin(), nearestHalf);
      const size_t bytes = width * plane.sampleBytes();
      std::memcpy(to, plane.isHalf() ? static_cast<const void*>(halves.data()) : line.data(), bytes);
      to += bytes;
    }
  return samples;
}

// Rearranges bytes for compression: first all bytes at even places, then all at odd ones; each is then
// replaced by its difference from the previous byte, plus 128. Neighbouring samples have similar high bytes,
// so most differences are small.  [OpenEXR, ZIP compression] All samples have an even number of bytes.
Bytes predicted(const Bytes& samples) {
  const size_t half = samples.size / 2;
  Bytes parted(samples.size), differences(samples.size);
  const std::byte* from = samples.data.get();
  std::byte *low = parted.data.get(), *high = low + half, *to = differences.data.get();
  for (size_t i = 0; i < half; ++i) low[i] = from[2 * i];
  for (size_t i = 0; i < half; ++i) high[i] = from[2 * i + 1];
  to[0] = low[0];
  for (size_t i = 1; i < samples.size; ++i)
    to[i] = static_cast<std::byte>(std::to_integer<unsigned>(low[i]) - std::to_integer<unsigned>(low[i - 1]) +
                                   128);
  return differences;
}

// A chunk: its first line, its size, and its pixels, uncompressed if compression does not make them smaller.
std::string chunkOf(const Planes& planes, int first, int end) {
  const Bytes samples = samplesOf(planes, first, end), differences = predicted(samples);
  const std::string packed = zlibStream({differences.data.get(), differences.size});
  const auto pixels = packed.size() < samples.size
                          ? std::string_view(packed)
                          : std::string_view(reinterpret_cast<const char*>(samples.data.get()), samples.size);
  std::string chunk;
  append(chunk, static_cast<int32_t>(first));
  append(chunk, static_cast<int32_t>(pixels.size()));
  return chunk.append(pixels);
}

} // namespace

void roundTo(Precision precision, std::span<float> values) {
  if (precision == Precision::half)
    for (float& value : values) value = half(half::FromBits, nearestHalf(value));
}

std::string exrBytes(std::span<const ExrLayer> layers, const ExrAttributes& attributes,
                     const Progress& progress) {
  assert(!layers.empty());
  const Image& picture = *layers[0].image;
  assert(picture.width > 0 && picture.height > 0);
  assert(std::ranges::all_of(layers, [&](const ExrLayer& layer) {
    const auto fits = [&](const Image& i) { return i.width == picture.width && i.height == picture.height; };
    return fits(*layer.image) && (!layer.factor || fits(*layer.factor));
  }));
  const Planes planes = planesOf(layers);
  std::vector<std::string> chunks(static_cast<size_t>((picture.height - 1) / kLinesOfChunk + 1));
  tbb::parallel_for(size_t{0}, chunks.size(), [&](size_t i) {
    progress.checkpoint();
    const int first = static_cast<int>(i) * kLinesOfChunk;
    chunks[i] = chunkOf(planes, first, std::min(first + kLinesOfChunk, picture.height));
  });
  std::string file = headOf(planes, attributes, picture);
  uint64_t offset = file.size() + chunks.size() * sizeof(uint64_t);
  for (const std::string& chunk : chunks) {
    append(file, offset);
    offset += chunk.size();
  }
  file.reserve(offset);
  for (std::string& chunk : chunks) file += std::exchange(chunk, {});
  return file;
}

void writeExr(const std::filesystem::path& path, std::span<const ExrLayer> layers,
              const ExrAttributes& attributes, const Progress& progress) {
  assert(!layers.empty());
  writeFileAtomically(path, exrBytes(layers, attributes, progress));
}

void writeExr(const std::filesystem::path& path, const Image& image, Precision precision) {
  assert(image.channels >= 1 && image.channels <= 4);
  static const std::array<ChannelSet, 4> names{{{"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}}};
  const ExrLayer layer{names[static_cast<size_t>(image.channels - 1)], &image, precision};
  writeExr(path, std::span(&layer, 1));
}

} // namespace surflect::image
