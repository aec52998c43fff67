#include "surfel/base/error.h"

#include <gtest/gtest.h>

namespace surflect {
namespace {

TEST(Error, IsOneLineOfFileFieldFoundAndExpected) {
  const Error error =
      Error::mismatch("a unit vector", "length 0").at("direction").at("lights[12]").in("scan.json");
  EXPECT_STREQ(error.what(), "scan.json: lights[12].direction: found length 0, expected a unit vector");
  EXPECT_EQ(error.file(), "scan.json");
  EXPECT_EQ(error.field(), "lights[12].direction");
}

TEST(Error, LeavesOutWhatIsNotKnown) {
  EXPECT_STREQ(Error("cannot open").what(), "cannot open");
  EXPECT_STREQ(Error("cannot open").in("a.ply").what(), "a.ply: cannot open");
  EXPECT_STREQ(Error("missing").at("w").what(), "w: missing");
}

TEST(Error, IndicesJoinWithoutADot) {
  EXPECT_STREQ(Error("bad").at("[3]").at("rows").at("matrix").what(), "matrix.rows[3]: bad");
}

TEST(Error, TheInnermostFileIsKept) {
  EXPECT_EQ(Error("bad").in("inner.exr").in("outer.json").file(), "inner.exr");
}

} // namespace
} // namespace surflect
