#include "srf/model/alpha_file.h"

#include "surfel/base/error.h"
#include "tests/srf/image/files.h"
#include "tests/support/damage.h"

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

TEST(AlphaFile, DamageIsRefusedOrChangesNothing) {
  const codec::AlphaPlane plane = randomPlane();
  tryDamage(packAlpha(plane), [&](std::span<const std::byte> damaged) {
    EXPECT_EQ(unpackAlpha(damaged, 37, 21).levels(), plane.levels());
  });
}

TEST(AlphaFile, ErrorsNameTheFieldWhatWasFoundAndExpected) {
  const std::vector<std::byte> packed = packAlpha(randomPlane());
  const auto complaintOf = [&](size_t at, std::byte byte) {
    std::vector<std::byte> changed = packed;
    changed[at] = byte;
    return image::errorOf([&] { unpackAlpha(changed, 37, 21); });
  };
  EXPECT_EQ(complaintOf(0, std::byte{'x'}), "magic: found other bytes, expected \"srf alph\"");
  EXPECT_EQ(complaintOf(8, std::byte{2}), "version: found 2, expected 1");
  EXPECT_EQ(complaintOf(12, std::byte{38}), "width: found 38, expected 37");
  EXPECT_EQ(image::errorOf([&] { unpackAlpha(packed, 21, 37); }), "width: found 37, expected 21");
  EXPECT_EQ(complaintOf(packed.size() - 1, ~packed.back()),
            "levels: found other content, expected a zlib stream of 777 bytes");
}

} // namespace
} // namespace surflect::model
