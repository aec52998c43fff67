#include "srf/image/exr.h"

#include "surfel/base/file.h"
#include "tests/srf/image/files.h"

#include <cstring>
#include <limits>
#include <random>

namespace surflect::image {
namespace {

// A scan-line file of several parts, none compressed, written after the format's specification.
class FileBuilder {
public:
  enum Type : int32_t { integer = 0, half = 1, single = 2 };
  struct Channel {
    std::string name;
    Type type;
    uint32_t bits; // of each of its samples
  };
  struct Part {
    std::string name;
    std::vector<Channel> channels; // in alphabetical order
  };

  static std::string multiPart(int width, int height, const std::vector<Part>& parts) {
    std::string file = raw<int32_t>(20000630) + raw<int32_t>(2 | 0x1000);
    for (const Part& part : parts) file += header(part, width, height);
    file += '\0';
    size_t offset = file.size() + parts.size() * static_cast<size_t>(height) * 8;
    std::string chunks;
    for (size_t p = 0; p < parts.size(); ++p)
      for (int y = 0; y < height; ++y) {
        file += raw<uint64_t>(offset + chunks.size());
        std::string samples;
        for (const Channel& channel : parts[p].channels)
          for (int x = 0; x < width; ++x)
            samples += channel.type == half ? raw(static_cast<uint16_t>(channel.bits)) : raw(channel.bits);
        chunks += raw(static_cast<int32_t>(p)) + raw<int32_t>(y) + raw(static_cast<int32_t>(samples.size())) +
                  samples;
      }
    return file + chunks;
  }

  template <class T> static std::string raw(T value) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return bytes;
  }

  static std::string attribute(const std::string& name, const std::string& type, const std::string& value) {
    return name + '\0' + type + '\0' + raw(static_cast<int32_t>(value.size())) + value;
  }

  static std::string box(int x0, int y0, int x1, int y1) { return raw(x0) + raw(y0) + raw(x1) + raw(y1); }

private:
  static std::string header(const Part& part, int width, int height) {
    std::string channels;
    for (const Channel& c : part.channels)
      channels += c.name + '\0' + raw<int32_t>(c.type) + raw<int32_t>(0) + raw<int32_t>(1) + raw<int32_t>(1);
    const std::string window = box(0, 0, width - 1, height - 1);
    return attribute("channels", "chlist", channels + '\0') + attribute("chunkCount", "int", raw(height)) +
           attribute("compression", "compression", std::string(1, '\0')) +
           attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window) +
           attribute("lineOrder", "lineOrder", std::string(1, '\0')) +
           attribute("name", "string", part.name) + attribute("pixelAspectRatio", "float", raw(1.f)) +
           attribute("screenWindowCenter", "v2f", raw(0.f) + raw(0.f)) +
           attribute("screenWindowWidth", "float", raw(1.f)) + attribute("type", "string", "scanlineimage") +
           '\0';
  }
};

class Exr : public ::testing::Test {
protected:
  std::filesystem::path file() const { return folder / "a.exr"; }
  Image readAll(const std::string& bytes) const {
    writeBytes(file(), bytes);
    const ExrFile exr(file());
    return exr.read(exr.channels());
  }

  TemporaryFolder folder;
};

TEST_F(Exr, FloatsSurviveARoundTrip) {
  for (int channels = 1; channels <= 4; ++channels) {
    const Image image = randomImage(23, 17, channels, -1e5f, 1e5f, 5);
    writeExr(file(), image, Precision::single);
    const ExrFile exr(file());
    EXPECT_EQ(exr.width(), 23);
    EXPECT_EQ(exr.height(), 17);
    ChannelSet set = colorChannels(exr, "");
    if (const auto alpha = alphaChannel(exr, "")) set.push_back(*alpha);
    EXPECT_EQ(exr.read(set).values, image.values);
  }
}

TEST_F(Exr, HalvesKeepElevenBits) {
  const Image image = randomImage(23, 17, 3, -900, 900, 6);
  writeExr(file(), image);
  const Image back = ExrFile(file()).read({"R", "G", "B"});
  for (size_t i = 0; i < image.values.size(); ++i)
    EXPECT_NEAR(back.values[i], image.values[i], std::ldexp(std::abs(image.values[i]), -11) + 1e-7f);
}

TEST_F(Exr, HalvesAreClampedToTheLargestFiniteOne) {
  Image image(3, 1, 1);
  image.values = {1e6f, -1e6f, std::numeric_limits<float>::infinity()};
  writeExr(file(), image);
  EXPECT_EQ(ExrFile(file()).read({"Y"}).values,
            std::vector<float>({65504, -65504, std::numeric_limits<float>::infinity()}));
}

TEST_F(Exr, RoundingIsWhatAFileDoes) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> exponent(-30, 20);
  Image image(64, 64, 3);
  for (float& value : image.values) value = (random() % 2 ? 1.f : -1.f) * std::exp2(exponent(random));
  for (const Precision precision : {Precision::half, Precision::single}) {
    writeExr(file(), image, precision);
    std::vector<float> rounded = image.values;
    roundTo(precision, rounded);
    EXPECT_EQ(ExrFile(file()).read({"R", "G", "B"}).values, rounded);
  }
}

TEST_F(Exr, LayersReadInOnePassEqualLayersReadOneByOne) {
  std::vector<Image> images;
  std::vector<ExrLayer> layers;
  std::vector<ChannelSet> sets;
  for (unsigned l = 0; l < 9; ++l) images.push_back(randomImage(40, 70, 3, 0, 1, l));
  for (size_t l = 0; l < images.size(); ++l) {
    const std::string prefix = "ViewLayer.Combined_L0" + std::to_string(l) + ".";
    sets.push_back({prefix + "R", prefix + "G", prefix + "B"});
    layers.push_back({sets.back(), &images[l], l % 2 ? Precision::half : Precision::single});
  }
  writeExr(file(), layers);
  const ExrFile exr(file());
  EXPECT_EQ(exr.channels().size(), 27u);
  const std::vector<Image> together = exr.read(sets);
  for (size_t l = 0; l < images.size(); ++l) {
    EXPECT_EQ(together[l].values, ExrFile(file()).read(sets[l]).values);
    if (l % 2 == 0) {
      EXPECT_EQ(together[l].values, images[l].values);
    }
    EXPECT_EQ(colorChannels(exr, "ViewLayer.Combined_L0" + std::to_string(l)), sets[l]);
  }
}

TEST_F(Exr, AChannelCanServeSeveralSetsInAnyOrder) {
  const Image image = randomImage(9, 8, 4, 0, 1, 7);
  writeExr(file(), image, Precision::single);
  const std::vector<ChannelSet> sets{{"A", "R"}, {"A"}, {"R", "R"}};
  const std::vector<Image> images = ExrFile(file()).read(sets);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 9; ++x) {
      EXPECT_EQ(images[0].at(x, y)[0], image.at(x, y)[3]);
      EXPECT_EQ(images[0].at(x, y)[1], image.at(x, y)[0]);
      EXPECT_EQ(images[1].at(x, y)[0], image.at(x, y)[3]);
      EXPECT_EQ(images[2].at(x, y)[1], image.at(x, y)[0]);
    }
}

TEST_F(Exr, TheDisplayWindowIsReadWhereverTheDataLies) {
  const Image image = randomImage(6, 50, 1, 0, 1, 8);
  writeExr(file(), image, Precision::single);
  const std::string written = readFile(file());
  const std::string key = FileBuilder::attribute("displayWindow", "box2i", FileBuilder::box(0, 0, 5, 49));
  ASSERT_NE(written.find(key), std::string::npos);
  const int windows[][4] = {{-2, -3, 7, 60}, {2, 10, 4, 45}, {3, -4, 20, 33}, {10, 0, 12, 3}, {0, 90, 3, 92}};
  for (const auto& [x0, y0, x1, y1] : windows) {
    std::string moved = written;
    moved.replace(moved.find(key), key.size(),
                  FileBuilder::attribute("displayWindow", "box2i", FileBuilder::box(x0, y0, x1, y1)));
    const Image seen = readAll(moved);
    ASSERT_EQ(seen.width, x1 - x0 + 1);
    ASSERT_EQ(seen.height, y1 - y0 + 1);
    for (int y = 0; y < seen.height; ++y)
      for (int x = 0; x < seen.width; ++x) {
        const int dataX = x + x0, dataY = y + y0;
        const bool inside = dataX >= 0 && dataY >= 0 && dataX < 6 && dataY < 50;
        EXPECT_EQ(seen.at(x, y)[0], inside ? image.at(dataX, dataY)[0] : 0);
      }
  }
}

TEST_F(Exr, MemoryIsNotTakenForPixelsThatTheFileHasNoBytesFor) {
  writeExr(file(), randomImage(6, 50, 4, 0, 1, 8), Precision::single);
  std::string claiming = readFile(file());
  const std::string key = FileBuilder::attribute("displayWindow", "box2i", FileBuilder::box(0, 0, 5, 49));
  claiming.replace(claiming.find(key), key.size(),
                   FileBuilder::attribute("displayWindow", "box2i", FileBuilder::box(0, 0, 16383, 16383)));
  EXPECT_NE(errorOf([&] { readAll(claiming); }).find("bytes for so many pixels"), std::string::npos);
}

TEST_F(Exr, AnAttributeThatIsLongerThanItsFileIsNamed) {
  const Image image(4, 4, 3);
  const ExrLayer layer{{"R", "G", "B"}, &image};
  writeExr(file(), std::span(&layer, 1), {{"software", "surflect"}});
  std::string claiming = readFile(file());
  const std::string honest("software\0string\0\x08\0\0\0", 20), boast("software\0string\0\0\0\0\x76", 20);
  claiming.replace(claiming.find(honest), honest.size(), boast);
  const std::string error = errorOf([&] { readAll(claiming); });
  EXPECT_NE(error.find("a.exr: software: found 1979711488 bytes of string, expected at most the"),
            std::string::npos)
      << error;
}

// The library would read on behind the size that is stated, and take what follows for attributes.
TEST_F(Exr, AnAttributeOfAnotherSizeThanItsTypeIsNamed) {
  writeExr(file(), Image(4, 4, 3), Precision::single);
  const std::string whole = readFile(file());
  const std::string_view headings[] = {
      {"channels\0chlist\0", 16}, {"compression\0compression\0", 24}, {"dataWindow\0box2i\0", 17}};
  for (const std::string_view heading : headings)
    for (const int change : {-1, 1}) {
      std::string damaged = whole;
      damaged[damaged.find(heading) + heading.size()] += static_cast<char>(change);
      const std::string error = errorOf([&] { readAll(damaged); });
      EXPECT_NE(error.find(std::string("a.exr: ") + heading.data() + ": found "), std::string::npos) << error;
    }
}

TEST_F(Exr, PartsAreFoundByNameAndSamplesOfEveryTypeBecomeFloat) {
  const std::string bytes = FileBuilder::multiPart(
      5, 3,
      {{"beauty",
        {{"B", FileBuilder::half, 0x3c00},
         {"G", FileBuilder::half, 0x4000},
         {"R", FileBuilder::half, 0xc200}}},
       {"id", {{"Y", FileBuilder::integer, 70000}}},
       {"light.L1",
        {{"R", FileBuilder::single, 0x3e800000}, {"light.L1.A", FileBuilder::single, 0x3f000000}}}});
  writeBytes(file(), bytes);
  const ExrFile exr(file());
  EXPECT_EQ(exr.channels(),
            ChannelSet({"beauty.B", "beauty.G", "beauty.R", "id.Y", "light.L1.R", "light.L1.A"}));
  EXPECT_EQ(colorChannels(exr, ""), ChannelSet({"R", "G", "B"}));
  const Image image = exr.read({"R", "G", "beauty.B", "id.Y", "light.L1.R", "light.L1.A"});
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 5; ++x) {
      const auto texel = image.at(x, y);
      EXPECT_EQ(std::vector<float>(texel.begin(), texel.end()),
                std::vector<float>({-3, 2, 1, 70000, 0.25f, 0.5f}));
    }
}

TEST_F(Exr, ThePictureIsThatOfOnePartAndNeverColoursOfOneWithAlphaOfAnother) {
  using Channels = std::vector<FileBuilder::Channel>;
  const auto channels = [](const std::string& names, uint32_t value) {
    Channels list;
    for (const char name : names) list.push_back({std::string(1, name), FileBuilder::half, value});
    return list;
  };
  constexpr uint32_t kOne = 0x3c00, kTwo = 0x4000;
  const auto shown = [&](const std::string& firstName, const std::string& firstChannels,
                         const std::string& secondName, const std::string& secondChannels) {
    writeBytes(file(), FileBuilder::multiPart(2, 2,
                                              {{firstName, channels(firstChannels, kOne)},
                                               {secondName, channels(secondChannels, kTwo)}}));
    const ExrFile exr(file());
    EXPECT_EQ(exr.parts(), (std::vector{firstName, secondName}));
    const ChannelSet colors = colorChannels(exr, "");
    const float value = exr.read(colors).values[0];
    EXPECT_EQ(exr.shownPart(), value == 1 ? firstName : secondName);
    const auto alpha = alphaChannel(exr, "");
    if (alpha) EXPECT_EQ(exr.read({*alpha}).values[0], value);
    return (value == 1 ? "first" : "second") + std::string(alpha ? ", alpha" : "");
  };
  EXPECT_EQ(shown("albedo", "BGR", "beauty", "ABGR"), "second, alpha");
  EXPECT_EQ(shown("beauty", "BGR", "albedo", "ABGR"), "first");
  EXPECT_EQ(shown("one", "ABGR", "two", "BGR"), "first, alpha");
  EXPECT_EQ(shown("one", "BGR", "two", "ABGR"), "second, alpha");
  EXPECT_EQ(shown("one", "BGR", "matte", "A"), "first");
  EXPECT_EQ(shown("depth", "Z", "grey", "Y"), "second");
  EXPECT_EQ(shown("id", "Y", "picture", "BGR"), "second");
  writeBytes(file(), FileBuilder::multiPart(
                         2, 2, {{"left", channels("ABGR", kOne)}, {"right", channels("ABGR", kTwo)}}));
  EXPECT_NE(errorOf([&] {
              colorChannels(ExrFile(file()), "");
            }).find("expected R, G, B or Y (or as `layer` of the frames: left, right)"),
            std::string::npos);
  EXPECT_EQ(alphaChannel(ExrFile(file()), ""), std::nullopt);
}

TEST_F(Exr, TheSameImageGivesTheSameBytes) {
  const Image image = randomImage(64, 40, 4, 0, 1, 9);
  const ExrLayer layer{{"R", "G", "B", "A"}, &image};
  const ExrAttributes attributes{{"software", "surflect"}, {"exposure", "0.5"}};
  writeExr(folder / "a.exr", std::span(&layer, 1), attributes);
  writeExr(folder / "b.exr", std::span(&layer, 1), attributes);
  EXPECT_EQ(readFile(folder / "a.exr"), readFile(folder / "b.exr"));
}

TEST_F(Exr, ThreadsDoNotChangeAByte) {
  const Image color = randomImage(64, 150, 3, 0, 1, 10), depth = randomImage(64, 150, 1, 0, 9, 11);
  const std::array layers{ExrLayer{{"R", "G", "B"}, &color, Precision::half, &depth},
                          ExrLayer{{"depth.Z"}, &depth, Precision::single}};
  writeExr(folder / "alone.exr", layers);
  struct Pool {
    Pool() { setExrThreads(3); }
    ~Pool() { setExrThreads(0); }
  };
  {
    const Pool pool;
    writeExr(folder / "together.exr", layers);
    EXPECT_EQ(ExrFile(folder / "together.exr").read({"depth.Z"}).values, depth.values);
  }
  EXPECT_EQ(readFile(folder / "together.exr"), readFile(folder / "alone.exr"));
}

TEST_F(Exr, WhatIsBelowALayersLeastValueIsWrittenAsThat) {
  const Image image = randomImage(40, 50, 3, -1, 1, 12), depth = randomImage(40, 50, 1, 1, 9, 13);
  const std::array layers{
      ExrLayer{{"R", "G", "B"}, &image, Precision::single, nullptr, 0.25f},
      ExrLayer{{"a.channel.with.a.name.of.more.than.31.characters"}, &depth, Precision::single}};
  writeExr(file(), layers, {{"software", "surflect"}});
  const ExrFile exr(file());
  EXPECT_EQ(exr.attribute("software"), "surflect");
  const Image color = exr.read({"R", "G", "B"});
  for (size_t i = 0; i < color.values.size(); ++i)
    EXPECT_EQ(color.values[i], std::max(image.values[i], 0.25f));
  EXPECT_EQ(exr.read(layers[1].channels).values, depth.values);
}

TEST_F(Exr, AFactorMultipliesWhatIsWritten) {
  const Image image = randomImage(23, 37, 3, 0, 10, 3), factor = randomImage(23, 37, 1, 0, 1, 4);
  Image product = image;
  for (size_t i = 0; i < product.values.size(); ++i) product.values[i] *= factor.values[i / 3];
  for (const Precision precision : {Precision::half, Precision::single}) {
    const ExrLayer multiplied{{"R", "G", "B"}, &image, precision, &factor},
        plain{{"R", "G", "B"}, &product, precision};
    writeExr(folder / "a.exr", std::span(&multiplied, 1));
    writeExr(folder / "b.exr", std::span(&plain, 1));
    EXPECT_EQ(readFile(folder / "a.exr"), readFile(folder / "b.exr"));
  }
}

TEST_F(Exr, MetadataComesBack) {
  const Image image(4, 4, 3);
  const ExrLayer layer{{"R", "G", "B"}, &image};
  writeExr(file(), std::span(&layer, 1), {{"software", "surflect"}, {"exposure", "0.5"}});
  const ExrFile exr(file());
  EXPECT_EQ(exr.attribute("software"), "surflect");
  EXPECT_EQ(exr.attribute("exposure"), "0.5");
  EXPECT_EQ(exr.attribute("author"), std::nullopt);
  EXPECT_EQ(exr.attribute("dataWindow"), std::nullopt); // not a text
}

TEST_F(Exr, AnUnknownChannelOrLayerIsNamed) {
  writeExr(file(), Image(2, 2, 4));
  const ExrFile exr(file());
  EXPECT_NE(errorOf([&] { exr.read({"R", "diffuse.R"}); }).find("a.exr: diffuse.R"), std::string::npos);
  EXPECT_NE(errorOf([&] { colorChannels(exr, "diffuse"); }).find("layer diffuse"), std::string::npos);
  EXPECT_EQ(alphaChannel(exr, "diffuse"), std::nullopt);
}

TEST_F(Exr, ChannelsAreListedWhereColoursAreMissing) {
  const Image image(2, 2, 3);
  const ExrLayer layer{{"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"}, &image};
  writeExr(file(), std::span(&layer, 1));
  const std::string complaint = errorOf([&] { colorChannels(ExrFile(file()), ""); });
  EXPECT_NE(complaint.find(
                "a.exr: channels: found ViewLayer.Combined.B, ViewLayer.Combined.G, ViewLayer.Combined.R, "
                "expected R, G, B or Y (or as `layer` of the frames: ViewLayer.Combined)"),
            std::string::npos)
      << complaint;
}

TEST_F(Exr, YIsGrayOnlyWhereItIsNoCoordinateAndNoLuminance) {
  const auto complaint = [&](const std::vector<std::string>& names, const std::string& layer) {
    std::vector<FileBuilder::Channel> channels;
    for (const std::string& name : names) channels.push_back({name, FileBuilder::half, 0});
    writeBytes(file(), FileBuilder::multiPart(2, 2, {{"part", channels}}));
    const std::string text = errorOf([&] { colorChannels(ExrFile(file()), layer); });
    return text.substr(std::min(text.size(), file().string().size()));
  };
  EXPECT_EQ(complaint({"X", "Y", "Z"}, ""),
            ": channels: found X, Y, Z (CIE XYZ, or a vector), expected R, G, B or Y");
  EXPECT_EQ(complaint({"Image.Y", "Normal.X", "Normal.Y", "Normal.Z"}, "Normal"),
            ": layer Normal: found X, Y, Z (CIE XYZ, or a vector), expected R, G, B or Y "
            "(or as `layer` of the frames: Image)");
  EXPECT_EQ(complaint({"Motion.X", "Motion.Y"}, "Motion"),
            ": layer Motion: found X, Y (CIE XYZ, or a vector), expected R, G, B or Y");
  EXPECT_EQ(complaint({"BY", "RY", "Y"}, ""),
            ": channels: found Y, RY, BY (luminance and chroma), expected R, G, B or Y");
}

TEST_F(Exr, ChromaticitiesAreItsStatement) {
  writeExr(file(), Image(2, 2, 3));
  const std::string written = readFile(file());
  EXPECT_TRUE(isRec709(*ExrFile(file()).colorStatement()->encoding.primaries)); // as we write
  EXPECT_EQ(ExrFile(file()).colorStatement()->encoding.transfer, Transfer{});

  const std::string ours = FileBuilder::raw(0.64f) + FileBuilder::raw(0.33f);
  const size_t red = written.find(ours);
  ASSERT_NE(red, written.npos);
  std::string other = written;
  other.replace(red, 8, FileBuilder::raw(0.75f) + FileBuilder::raw(0.25f));
  writeBytes(file(), other);
  EXPECT_EQ(ExrFile(file()).colorStatement()->encoding.primaries->red, (Chromaticity{0.75, 0.25}));
  other.replace(red, 32, std::string(32, '\0'));
  writeBytes(file(), other);
  EXPECT_NE(ExrFile(file()).colorStatement()->problem.find("primaries"), std::string::npos);

  const std::string plain = FileBuilder::multiPart(
      2, 2, {{"a", {{"Y", FileBuilder::half, 0}}}, {"b", {{"Y", FileBuilder::half, 0}}}});
  writeBytes(file(), plain);
  EXPECT_FALSE(ExrFile(file()).colorStatement());
  std::string aces = plain;
  aces.insert(8, FileBuilder::attribute("acesImageContainerFlag", "int", FileBuilder::raw(1)));
  writeBytes(file(), aces);
  EXPECT_EQ(ExrFile(file()).colorStatement()->encoding.primaries, kAces);
}

TEST_F(Exr, EveryTruncationIsRejected) {
  const Image image = randomImage(4, 20, 3, 0, 1, 10);
  writeExr(file(), image);
  const std::string parts = FileBuilder::multiPart(
      2, 2, {{"a", {{"Y", FileBuilder::half, 0}}}, {"b", {{"Y", FileBuilder::half, 0}}}});
  for (const std::string& whole : {readFile(file()), parts}) {
    readAll(whole);
    for (size_t length = 0; length < whole.size(); ++length)
      EXPECT_NE(errorOf([&] { readAll(whole.substr(0, length)); }), "") << "length " << length;
  }
}

TEST_F(Exr, DamageGivesAnErrorOrAPictureOfTheStatedSize) {
  writeExr(file(), randomImage(5, 4, 3, 0, 1, 11));
  const std::string whole = readFile(file());
  std::mt19937 random(12);
  int rejected = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = whole;
    damaged[random() % whole.size()] = static_cast<char>(random());
    try {
      const Image image = readAll(damaged);
      EXPECT_EQ(image.values.size(), static_cast<size_t>(image.width) * image.height * image.channels);
    } catch (const Error&) {
      ++rejected;
    }
  }
  EXPECT_GT(rejected, 500);
}

TEST_F(Exr, AClaimOfTooManyPixelsIsRejected) {
  writeExr(file(), Image(4, 4, 1), Precision::single);
  std::string whole = readFile(file());
  const std::string small = FileBuilder::box(0, 0, 3, 3);
  const std::string large = FileBuilder::box(0, 0, 40000, 40000);
  const std::string reversed = FileBuilder::box(3, 3, -3, -3);
  for (const std::string& window : {large, reversed}) {
    std::string damaged = whole;
    for (size_t at; (at = damaged.find(small)) != std::string::npos;)
      damaged.replace(at, small.size(), window);
    EXPECT_NE(errorOf([&] { readAll(damaged); }).find("a.exr"), std::string::npos);
  }
}

} // namespace
} // namespace surflect::image
