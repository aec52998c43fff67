#include "srf/codec/view_file.h"

#include "tests/srf/codec/synthetic.h"
#include "tests/support/damage.h"

#include <tbb/global_control.h>

#include <cstring>
#include <numeric>

namespace surflect::codec {
namespace {

using synthetic::glossySphere;

// A sphere with a hole; the image size is not a multiple of the block size.
ReflectanceStack smallStack() {
  ReflectanceStack stack = glossySphere(37, 5);
  for (int y = 16; y < 24; ++y)
    for (int x = 16; x < 24; ++x) stack.alpha.at(x, y)[0] = 0.49f;
  return stack;
}

std::string messageOf(const std::filesystem::path& path) {
  try {
    const ViewFile view(path);
    for (uint32_t b = 0; b < view.blockCount(); ++b) view.read(b);
  } catch (const Error& error) {
    EXPECT_EQ(error.file(), path.string());
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.field();
  }
  return "none";
}

// Rows of a stack.
ReflectanceStack rowsOf(const ReflectanceStack& stack, int top, int rows) {
  const auto cut = [&](const image::Image& image) {
    image::Image part(image.width, rows, image.channels);
    const size_t row = part.values.size() / static_cast<size_t>(rows);
    std::copy_n(image.values.begin() + static_cast<std::ptrdiff_t>(static_cast<size_t>(top) * row),
                part.values.size(), part.values.begin());
    return part;
  };
  ReflectanceStack part{stack.width, rows, {}, cut(stack.alpha)};
  for (const image::Image& light : stack.lights) part.lights.push_back(cut(light));
  return part;
}

TEST(ViewFile, WrittenByBandsOfRowsHasTheBytesOfTheWhole) {
  const image::TemporaryFolder folder;
  const ReflectanceStack stack = smallStack();
  const EncodeOptions options{.tolerance = 0.02, .white = 3};
  const EncodedView whole = encodeView(stack, options);
  ViewSummary summary;
  ViewFileWriter file(folder / "a.view", headerOf(stack.width, stack.height, stack.lights.size(), options));
  for (const auto& [top, rows] : {std::pair(0, 8), std::pair(8, 16), std::pair(24, 13)}) {
    const EncodedRows encoded = encodeRows(rowsOf(stack, top, rows), top, options);
    file.add(encoded.records);
    summary += encoded.summary;
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "a.view"));
  file.commit();
  const std::string written = readFile(folder / "a.view");
  EXPECT_EQ(written, std::string(reinterpret_cast<const char*>(whole.file.data()), whole.file.size()));
  EXPECT_EQ(summary.objectTexels, whole.summary.objectTexels);
  EXPECT_EQ(summary.values, whole.summary.values);
  EXPECT_EQ(summary.blocksOfRank, whole.summary.blocksOfRank);
}

TEST(ViewFile, AnUnfinishedWriterLeavesNothing) {
  const image::TemporaryFolder folder;
  {
    ViewFileWriter file(folder / "a.view", {16, 16, 1});
    file.add(std::vector<PlacedRecord>{{{0, 0}, std::vector<std::byte>(100)}});
  }
  EXPECT_TRUE(image::contentOf(folder.path()).empty());
}

TEST(ViewFile, HoldsEveryObjectTexelWithinTheTolerance) {
  const image::TemporaryFolder folder;
  const ReflectanceStack stack = smallStack();
  const EncodedView encoded = encodeView(stack, {.tolerance = 0.02, .white = 3});
  writeFileAtomically(folder / "a.view", encoded.file);
  const ViewFile view(folder / "a.view");
  EXPECT_EQ(view.header().width, 37);
  EXPECT_EQ(view.header().height, 37);
  EXPECT_EQ(view.header().lights, 5);
  EXPECT_EQ(view.header().white, 3.f);
  EXPECT_EQ(view.header().tolerance, 0.02f);

  uint64_t texels = 0;
  double squaredError = 0;
  for (int y = 0; y < stack.height; ++y) {
    for (int x = 0; x < stack.width; ++x) {
      const auto number = view.find({x / blockSize, y / blockSize});
      if (stack.alpha.at(x, y)[0] < 0.5f) continue;
      ++texels;
      ASSERT_TRUE(number);
      EXPECT_EQ(view.position(*number), (BlockPosition{x / blockSize, y / blockSize}));
      const Block block = view.read(*number);
      const int texel = y % blockSize * blockSize + x % blockSize;
      EXPECT_TRUE(block.present >> texel & 1);
      for (int l = 0; l < 5; ++l)
        for (int c = 0; c < 3; ++c) {
          double value = 0;
          for (int k = 0; k < block.stride; ++k)
            value += double{block.light(l)[k]} * block.texel(texel)[c * block.stride + k];
          squaredError += std::pow(value - stack.lights[l].at(x, y)[c], 2);
        }
    }
  }
  const ViewSummary& summary = encoded.summary;
  EXPECT_EQ(summary.objectTexels, texels);
  EXPECT_EQ(summary.values, texels * 15);
  EXPECT_NEAR(summary.squaredError, squaredError, 1e-9 * squaredError);
  EXPECT_EQ(summary.fileBytes, std::filesystem::file_size(folder / "a.view"));
  uint64_t blocks = 0;
  for (const uint64_t count : summary.blocksOfRank) blocks += count;
  EXPECT_EQ(blocks, view.blockCount());
}

TEST(ViewFile, FindsExactlyTheBlocksThatShowTheObject) {
  const image::TemporaryFolder folder;
  const ReflectanceStack stack = smallStack();
  writeFileAtomically(folder / "a.view", encodeView(stack, {}).file);
  const ViewFile view(folder / "a.view");
  uint32_t next = 0; // in row order
  for (int by = 0; by < 5; ++by) {
    for (int bx = 0; bx < 5; ++bx) {
      bool shows = false;
      for (int y = 8 * by; y < std::min(8 * by + 8, 37); ++y)
        for (int x = 8 * bx; x < std::min(8 * bx + 8, 37); ++x) shows |= stack.alpha.at(x, y)[0] >= 0.5f;
      const auto number = view.find({bx, by});
      ASSERT_EQ(number.has_value(), shows) << bx << ", " << by;
      if (shows) {
        EXPECT_EQ(*number, next++);
      }
    }
  }
  EXPECT_EQ(view.blockCount(), next);
  EXPECT_FALSE(view.find({2, 2}));
}

TEST(ViewFile, ViewWithoutObjectIsValid) {
  const image::TemporaryFolder folder;
  ReflectanceStack stack = glossySphere(20, 2);
  std::ranges::fill(stack.alpha.values, 0.f);
  writeFileAtomically(folder / "a.view", encodeView(stack, {}).file);
  EXPECT_EQ(ViewFile(folder / "a.view").blockCount(), 0u);
}

TEST(ViewFile, BytesDoNotDependOnTheNumberOfThreads) {
  const ReflectanceStack stack = glossySphere(100, 12);
  const auto encodedWith = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return encodeView(stack, {}).file;
  };
  EXPECT_EQ(encodedWith(1), encodedWith(4));
}

TEST(ViewFile, OverheadIsAtMostSixteenBytesAFullBlock) {
  ReflectanceStack stack{80, 80, {image::Image(80, 80, 3)}, image::Image(80, 80, 1)};
  std::ranges::fill(stack.alpha.values, 1.f); // black: no terms, overhead only
  const size_t fixed = 48;
  EXPECT_EQ(encodeView(stack, {}).file.size(), fixed + 100 * 16);
}

// A row of blocks with records of the given size.
ViewFile rowOfBlocks(const std::filesystem::path& path, int count, size_t bytes) {
  std::vector<PlacedRecord> blocks;
  for (int x = 0; x < count; ++x) blocks.push_back({{x, 0}, std::vector<std::byte>(bytes)});
  writeFileAtomically(path, viewFileBytes({count * blockSize, blockSize, 5}, blocks));
  return ViewFile(path);
}

TEST(ViewFile, AStretchEndsAtAGapOrWhenItIsLong) {
  const image::TemporaryFolder folder;
  const ViewFile view = rowOfBlocks(folder / "long.srfb", 16, 20000);
  const auto lengthOf = [&](std::vector<uint32_t> wanted) { return view.readRunLength(wanted); };
  EXPECT_EQ(lengthOf({3}), 1u);
  EXPECT_EQ(lengthOf({3, 4, 5, 7, 8}), 3u);
  EXPECT_EQ(lengthOf({0, 1, 2, 3, 4, 5, 6, 7, 8, 9}), 7u); // 2^17 bytes end within the seventh

  const ViewFile small = rowOfBlocks(folder / "small.srfb", 100, 4);
  std::vector<uint32_t> all(100);
  std::iota(all.begin(), all.end(), 0u);
  EXPECT_EQ(small.readRunLength(all), 64u);
}

TEST(ViewFile, WhatCannotBeReadNamesItsBlock) {
  const image::TemporaryFolder folder;
  const ViewFile view = rowOfBlocks(folder / "cut.srfb", 3, 1000);
  std::filesystem::resize_file(view.path(), std::filesystem::file_size(view.path()) - 1500);
  const auto fieldOf = [&](const auto& read) {
    try {
      read();
    } catch (const Error& error) {
      EXPECT_EQ(error.file(), view.path().string());
      return error.field();
    }
    return std::string("none");
  };
  EXPECT_EQ(fieldOf([&] { view.read(2); }), "block (2, 0)");
  EXPECT_EQ(fieldOf([&] {
              view.read(std::vector<uint32_t>{1, 2}, [](size_t, const Block&) {});
            }),
            "block (1, 0)");
}

TEST(ViewFile, AStretchHoldsWhatItsBlocksHold) {
  const image::TemporaryFolder folder;
  writeFileAtomically(folder / "some.srfb", encodeView(smallStack(), {}).file);
  const ViewFile view(folder / "some.srfb");
  const std::vector<uint32_t> some{0, 1, 3, 7, 8};
  ASSERT_EQ(view.readRunLength(some), some.size());
  size_t next = 0;
  view.read(some, [&](size_t i, const Block& block) {
    ASSERT_EQ(i, next++);
    EXPECT_EQ(block.present, view.read(some[i]).present);
    EXPECT_EQ(block.values, view.read(some[i]).values);
  });
  EXPECT_EQ(next, some.size());
}

TEST(ViewFile, EveryDamageIsRefused) {
  const image::TemporaryFolder folder;
  const auto file = encodeView(glossySphere(20, 5), {.tolerance = 0.2}).file;
  const std::filesystem::path path = folder / "damaged.view";
  tryDamage(file, [&](std::span<const std::byte> damaged) {
    image::writeBytes(path, {reinterpret_cast<const char*>(damaged.data()), damaged.size()});
    const ViewFile view(path);
    EXPECT_TRUE(damaged.size() == file.size()) << "a truncation is noticed when the file is opened";
    for (uint32_t block = 0; block < view.blockCount(); ++block) view.read(block);
    EXPECT_TRUE(std::ranges::equal(damaged, file));
  });
}

TEST(ViewFile, DamageNamesItsField) {
  const image::TemporaryFolder folder;
  const auto file = encodeView(smallStack(), {}).file;
  const auto fieldWith = [&](size_t at, uint32_t value) {
    auto damaged = file;
    std::memcpy(damaged.data() + at, &value, sizeof value);
    writeFileAtomically(folder / "damaged.view", damaged);
    return messageOf(folder / "damaged.view");
  };
  EXPECT_EQ(fieldWith(0, 0), "magic");
  EXPECT_EQ(fieldWith(8, 2), "version");
  EXPECT_EQ(fieldWith(12, 7), "layout");
  EXPECT_EQ(fieldWith(16, 0), "width");
  EXPECT_EQ(fieldWith(20, 1u << 31), "height");
  EXPECT_EQ(fieldWith(24, 65536), "lights");
  EXPECT_EQ(fieldWith(28, 26), "blocks");
  EXPECT_EQ(fieldWith(32, 0x7f800000), "white"); // infinity
  EXPECT_EQ(fieldWith(36, 0xbf800000), "tolerance");
  EXPECT_EQ(fieldWith(44, 99), "checksum of header and index");
  const std::string last = fieldWith(file.size() - 4, 0xdeadbeef);
  EXPECT_EQ(last.substr(0, 7) + " " + last.substr(last.size() - 8), "block ( checksum");
}

// Counts that a small file cannot hold are rejected before memory is allocated for them.
TEST(ViewFile, HugeCountsInASmallFileAreRefused) {
  const image::TemporaryFolder folder;
  auto file = encodeView(smallStack(), {}).file;
  const uint32_t side = largestViewSide, blocks = 1 << 24;
  std::memcpy(file.data() + 16, &side, 4);
  std::memcpy(file.data() + 20, &side, 4);
  std::memcpy(file.data() + 28, &blocks, 4);
  writeFileAtomically(folder / "huge.view", file);
  EXPECT_EQ(messageOf(folder / "huge.view"), "size");
}

TEST(ViewFile, MissingFileAndFolderAreErrors) {
  const image::TemporaryFolder folder;
  EXPECT_THROW(ViewFile{folder / "missing.view"}, Error);
  EXPECT_THROW(ViewFile{folder / "."}, Error);
}

TEST(ViewEncoder, BadInputNamesImageAndPixel) {
  const auto fieldOf = [](const ReflectanceStack& stack, const EncodeOptions& options = {}) {
    try {
      encodeView(stack, options);
    } catch (const Error& error) {
      return error.field();
    }
    return std::string("none");
  };
  ReflectanceStack stack = glossySphere(20, 3);
  stack.lights[1].at(9, 10)[2] = std::nanf("");
  EXPECT_EQ(fieldOf(stack), "lights[1].pixel (9, 10)");
  stack.lights[1].at(9, 10)[2] = 1e30f;
  EXPECT_EQ(fieldOf(stack), "lights[1].pixel (9, 10)");
  stack.lights[1] = image::Image(20, 20, 4);
  EXPECT_EQ(fieldOf(stack), "lights[1]");
  stack = glossySphere(20, 3);
  stack.alpha = image::Image(19, 20, 1);
  EXPECT_EQ(fieldOf(stack), "alpha");
  stack.lights.clear();
  EXPECT_EQ(fieldOf(stack), "lights");
  EXPECT_EQ(fieldOf(glossySphere(20, 1), {.white = 0}), "white");
  EXPECT_EQ(fieldOf(glossySphere(20, 1), {.tolerance = -1}), "tolerance");
  EXPECT_EQ(fieldOf({}), "size");
}

TEST(ViewEncoder, SummariesAddUp) {
  const ViewSummary small = encodeView(glossySphere(20, 3), {}).summary;
  const ViewSummary large = encodeView(glossySphere(60, 3), {.tolerance = 0.01}).summary;
  ViewSummary sum = small;
  sum += large;
  EXPECT_EQ(sum.fileBytes, small.fileBytes + large.fileBytes);
  EXPECT_EQ(sum.values, small.values + large.values);
  EXPECT_EQ(sum.blocksOfRank[1], small.blocksOfRank[1] + large.blocksOfRank[1]);
  EXPECT_EQ(sum.squaredError, small.squaredError + large.squaredError);
}

// A Lambert sphere under lights from all around.
ReflectanceStack plainSphere(int size, int lights, const std::array<float, 3>& albedo) {
  ReflectanceStack stack{size, size, std::vector<image::Image>(lights, image::Image(size, size, 3)),
                         image::Image(size, size, 1)};
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const auto side = static_cast<float>(size);
      const float nx = 2.2f * ((static_cast<float>(x) + 0.5f) / side - 0.5f);
      const float ny = 2.2f * (0.5f - (static_cast<float>(y) + 0.5f) / side);
      if (nx * nx + ny * ny >= 1) continue;
      stack.alpha.at(x, y)[0] = 1;
      const float nz = std::sqrt(1 - nx * nx - ny * ny);
      for (int l = 0; l < lights; ++l) {
        const float lz = 2 * (static_cast<float>(l) + 0.5f) / static_cast<float>(lights) - 1;
        const float r = std::sqrt(1 - lz * lz), turn = 2.39996f * static_cast<float>(l);
        const float cosine = nx * r * std::cos(turn) + ny * r * std::sin(turn) + nz * lz;
        for (size_t c = 0; c < 3; ++c) stack.lights[l].at(x, y)[c] = albedo[c] * std::max(0.f, cosine);
      }
    }
  return stack;
}

// All lights at once, as in a white furnace. Rounding to the nearest level would show 1.2 % too much green
// and 4.5 % too little blue.
TEST(ViewEncoder, APlainSphereKeepsItsHueInTheFurnace) {
  const image::TemporaryFolder folder;
  const ReflectanceStack stack = plainSphere(96, 24, {0.8f, 0.1f, 0.02f});
  for (const double tolerance : {0.01, 0.02, 0.05, 0.1}) {
    writeFileAtomically(folder / "a.view", encodeView(stack, {.tolerance = tolerance}).file);
    const ViewFile view(folder / "a.view");
    std::array<double, 3> truth{}, shown{};
    for (uint32_t b = 0; b < view.blockCount(); ++b) {
      const Block block = view.read(b);
      const BlockPosition at = view.position(b);
      for (int t = 0; t < blockTexels; ++t) {
        if (!(block.present >> t & 1)) continue;
        const int x = at.x * blockSize + t % blockSize, y = at.y * blockSize + t / blockSize;
        for (size_t l = 0; l < 24; ++l)
          for (int c = 0; c < 3; ++c) {
            truth[c] += double{stack.lights[l].at(x, y)[c]};
            for (int k = 0; k < block.stride; ++k)
              shown[c] += double{block.light(l)[k]} * block.texel(t)[c * block.stride + k];
          }
      }
    }
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(shown[c] / truth[c], 1, 2.4e-4) << c << ", " << tolerance;
  }
}

TEST(ViewEncoder, CancelledEncodingThrows) {
  Progress progress;
  progress.cancelled = [] { return true; };
  EXPECT_THROW(encodeView(glossySphere(20, 3), {}, progress), Cancelled);
}

// The codec is designed for smooth shading with a highlight.
TEST(ViewEncoder, CompressesASmoothStack) {
  const ReflectanceStack stack = glossySphere(160, 28);
  const ViewSummary summary = encodeView(stack, {}).summary;
  EXPECT_GT(compressionRatio(summary), 9.1);
  EXPECT_GT(psnrDb(summary, 1), 51.3);
}

} // namespace
} // namespace surflect::codec
