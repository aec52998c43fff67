#include "surfel/base/base64.h"

namespace surflect {
namespace {

TEST(Base64, TestVectorsOfTheStandard) { // RFC 4648, §10
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

TEST(Base64, BytesAreUnsigned) { EXPECT_EQ(base64("\xfb\xff\xfe"), "+//+"); }

} // namespace
} // namespace surflect
