#include "srf/model/alpha_file.h"

#include "surfel/base/error.h"
#include "tests/srf/image/files.h"

namespace surflect::model {
namespace {

codec::AlphaPlane randomPlane() { return codec::AlphaPlane(image::randomImage(37, 21, 1, 0, 1, 7)); }

TEST(AlphaFile, WhatIsPackedIsUnpackedEqual) {
  const codec::AlphaPlane plane = randomPlane();
  const codec::AlphaPlane unpacked = unpackAlpha(packAlpha(plane), 37, 21);
  EXPECT_EQ(unpacked.width(), 37);
  EXPECT_EQ(unpacked.height(), 21);
  EXPECT_EQ(unpacked.levels(), plane.levels());
}

TEST(AlphaFile, EveryTruncationAndEverySurplusByteIsRefused) {
  const std::string packed = packAlpha(randomPlane());
  for (size_t length = 0; length < packed.size(); ++length)
    EXPECT_THROW(unpackAlpha(packed.substr(0, length), 37, 21), Error) << length;
  EXPECT_THROW(unpackAlpha(packed + '\0', 37, 21), Error);
}

TEST(AlphaFile, EveryFlippedBitIsRefusedOrChangesNothing) {
  const codec::AlphaPlane plane = randomPlane();
  const std::string packed = packAlpha(plane);
  for (size_t bit = 0; bit < 8 * packed.size(); ++bit) {
    std::string damaged = packed;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ 1 << bit % 8);
    try {
      EXPECT_EQ(unpackAlpha(damaged, 37, 21).levels(), plane.levels()) << bit;
    } catch (const Error&) {
    }
  }
}

TEST(AlphaFile, ErrorsNameTheFieldWhatWasFoundAndExpected) {
  const std::string packed = packAlpha(randomPlane());
  const auto complaintOf = [&](size_t at, char byte) {
    std::string changed = packed;
    changed[at] = byte;
    return image::errorOf([&] { unpackAlpha(changed, 37, 21); });
  };
  EXPECT_EQ(complaintOf(0, 'x'), "magic: found other bytes, expected 'srf alph'");
  EXPECT_EQ(complaintOf(8, 2), "version: found 2, expected 1");
  EXPECT_EQ(complaintOf(12, 38), "size: found 38 x 21 pixels, expected 37 x 21 pixels");
  EXPECT_EQ(image::errorOf([&] { unpackAlpha(packed, 21, 37); }),
            "size: found 37 x 21 pixels, expected 21 x 37 pixels");
  EXPECT_EQ(complaintOf(packed.size() - 1, static_cast<char>(packed.back() + 1)),
            "levels: found other content, expected a zlib stream of 777 bytes");
}

} // namespace
} // namespace surflect::model
