#include "surfel/base/archive.h"

#include "surfel/base/file.h"
#include "tests/srf/image/files.h"
#include "tests/support/damage.h"

#include <array>
#include <cstring>
#include <limits>

namespace surflect {
namespace {

enum class Kind { plain, striped, dotted };

struct Part {
  std::string name;
  std::vector<std::array<double, 2>> places;
  friend bool operator==(const Part&, const Part&) = default;
};

struct Sample {
  Kind kind = Kind::striped;
  int width = 12;
  float white = 0.5f;
  bool isClosed = true;
  std::vector<std::array<uint32_t, 3>> triangles{{0, 1, 2}, {2, 3, 0}};
  std::vector<Part> parts{{"one", {{0, 1}, {2, 3}}}, {"", {}}};
  friend bool operator==(const Sample&, const Sample&) = default;
};

void describePart(Archive& archive, Part& part) {
  size_t letters = part.name.size(), places = part.places.size();
  archive.number<uint8_t>("letters", letters, {0, 100});
  archive.array<char>("name", part.name, letters);
  archive.number<uint16_t>("placeCount", places, {0, 1000});
  archive.array<double>("places", part.places, places, {-10, 10});
}

void describeSample(Archive& archive, Sample& sample) {
  size_t triangles = sample.triangles.size(), parts = sample.parts.size();
  archive.magic("sample");
  archive.constant<uint32_t>("version", 3);
  archive.choice<uint8_t>("kind", sample.kind, Kind::dotted);
  archive.number<uint64_t>("width", sample.width, {1, 4096});
  archive.number<float>("white", sample.white, {1e-30f});
  archive.number<uint8_t>("isClosed", sample.isClosed, {0, 1});
  archive.number<uint64_t>("triangleCount", triangles, {});
  archive.array<uint32_t>("triangles", sample.triangles, triangles, Below(4));
  archive.number<uint64_t>("partCount", parts, {});
  archive.each("parts", sample.parts, parts, [&](Part& part) { describePart(archive, part); });
  archive.checksum("checksum", archive.hash());
}

std::vector<std::byte> bytesOf(const Sample& sample) { return written(sample, describeSample); }

Sample read(std::span<const std::byte> bytes) {
  Sample sample{.triangles = {}, .parts = {}};
  parse(bytes, [&](Archive& archive) { describeSample(archive, sample); });
  return sample;
}

// The error of a sample with one thing changed.
template <class Change> std::string errorWith(const Change& change) {
  Sample sample;
  change(sample);
  return image::errorOf([&] { read(bytesOf(sample)); });
}

TEST(Archive, ReadsWhatItWrote) {
  Sample sample;
  EXPECT_EQ(read(bytesOf(sample)), sample);
  sample = {Kind::dotted, 4096, std::numeric_limits<float>::max(), false, {}, {}};
  EXPECT_EQ(read(bytesOf(sample)), sample);
}

TEST(Archive, WritesNumbersOneAfterAnotherTheLowestByteFirst) {
  const auto bytes = written(0, [](Archive& archive, int&) {
    int width = 0x0102;
    float white = 1;
    archive.magic("ab");
    archive.number<uint32_t>("width", width, {});
    archive.number<float>("white", white, {});
  });
  const std::array<uint8_t, 10> expected{'a', 'b', 2, 1, 0, 0, 0, 0, 0x80, 0x3f};
  EXPECT_TRUE(std::ranges::equal(bytes, std::as_bytes(std::span(expected))));
}

TEST(Archive, EveryDamageIsRefused) {
  const std::vector<std::byte> bytes = bytesOf({});
  tryDamage(bytes, [&](std::span<const std::byte> damaged) {
    EXPECT_EQ(read(damaged), Sample{});
    EXPECT_TRUE(std::ranges::equal(damaged, bytes)); // the checksum covers all
  });
}

TEST(Archive, ErrorsNameTheFieldWhatWasFoundAndExpected) {
  EXPECT_EQ(errorWith([](Sample& s) { s.kind = static_cast<Kind>(3); }), "kind: found 3, expected 0..2");
  EXPECT_EQ(errorWith([](Sample& s) { s.width = 0; }), "width: found 0, expected 1..4096");
  EXPECT_EQ(errorWith([](Sample& s) { s.triangles[1][2] = 4; }), "triangles[1]: found 4, expected 0..3");
  EXPECT_EQ(errorWith([](Sample& s) { s.parts[0].places[1][0] = -11; }),
            "parts[0].places[1]: found -11, expected -10..10");
  EXPECT_EQ(errorWith([](Sample& s) { s.parts[1].name.assign(101, 'a'); }),
            "parts[1].letters: found 101, expected 0..100");
  std::vector<std::byte> bytes = bytesOf({});
  bytes[6] = std::byte{4};
  EXPECT_EQ(image::errorOf([&] { read(bytes); }), "version: found 4, expected 3");
  bytes[0] = std::byte{'S'};
  EXPECT_EQ(image::errorOf([&] { read(bytes); }), "magic: found other bytes, expected \"sample\"");
  bytes = bytesOf({});
  bytes.push_back({});
  EXPECT_EQ(image::errorOf([&] { read(bytes); }), "end: found 1 more bytes, expected the end");
}

TEST(Archive, FloatsThatAreNotFiniteAreInNoRange) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(errorWith([](Sample& s) { s.white = kInfinity; }),
            "white: found inf, expected a finite number of at least 1e-30");
  EXPECT_EQ(errorWith([](Sample& s) { s.white = -std::nanf(""); }).substr(0, 7), "white: ");
  for (const float wrong : {kInfinity, -kInfinity, std::nanf("")}) {
    EXPECT_FALSE(Range<float>().holds(wrong));
    const std::vector<std::byte> bytes =
        written(wrong, [](Archive& archive, float& number) { archive.number<float>("number", number, {}); });
    float number = 0;
    EXPECT_NE(image::errorOf([&] {
                parse(bytes, [&](Archive& archive) { archive.number<float>("number", number, {}); });
              }).find("expected a finite number"),
              std::string::npos);
  }
}

TEST(Archive, CountsThatTheBytesCannotHoldTakeNoMemory) {
  for (const uint64_t count : {uint64_t{1} << 40, uint64_t{1} << 61, ~uint64_t{0}}) {
    const auto bytes = written(
        count, [](Archive& archive, uint64_t& stored) { archive.number<uint64_t>("count", stored, {}); });
    std::vector<std::array<double, 2>> places;
    std::vector<Part> parts;
    const auto readWith = [&](const auto& describe) {
      return image::errorOf([&] {
        parse(bytes, [&](Archive& archive) {
          size_t stored = 0;
          archive.number<uint64_t>("count", stored, {});
          describe(archive, stored);
        });
      });
    };
    EXPECT_EQ(readWith([&](Archive& archive, size_t stored) { archive.array<double>("a", places, stored); }),
              "a: found 0 bytes, expected " + std::to_string(count) + " times 16 bytes");
    EXPECT_EQ(readWith([&](Archive& archive, size_t stored) {
                archive.each("a", parts, stored, [&](Part& part) { describePart(archive, part); });
              }),
              "a[0].letters: found 0 bytes, expected 1 times 1 bytes");
  }
}

TEST(Archive, NoIndexIsBelowZero) {
  EXPECT_FALSE(Range<uint32_t>(Below(0)).holds(0));
  EXPECT_TRUE(Range<uint32_t>(Below(1)).holds(0));
  EXPECT_FALSE(Range<uint32_t>(Below(1)).holds(1));
  EXPECT_TRUE(Range<uint8_t>(Below(1000)).holds(255));
}

} // namespace
} // namespace surflect
