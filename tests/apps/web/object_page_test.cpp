#include "apps/web/object_page.h"

#include "apps/web/page_folder.h"
#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <string>

namespace surflect::web {
namespace {

// The error of requireHeldByPage() for maps of these sizes, whose first term has view maps of 32 cells along
// a side; empty if a page holds them.
std::string problemOf(size_t triangles, size_t terms, size_t channels, size_t meanBytes,
                      int higherViewSize = 32) {
  lfm::LightFieldMaps maps;
  maps.viewSize = 32;
  maps.higherViewSize = higherViewSize;
  maps.mesh.triangles.resize(triangles);
  maps.terms.resize(terms);
  maps.channels = channels;
  maps.mean.maps.data.resize(meanBytes);
  try {
    requireHeldByPage(maps);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ObjectPage, RefusesMapsThatBrowsersDoNotHoldByTheirField) {
  constexpr size_t kPlaces = size_t{2048} * 2048;
  EXPECT_EQ(problemOf(kPlaces / 5, 1, 3, 0), "");
  EXPECT_NE(problemOf(kPlaces / 5 + 1, 1, 3, 0).find("maps: 838861 triangles of 1 term are"),
            std::string::npos);
  EXPECT_NE(problemOf(0, 1, 3, 0).find("maps.triangles: found none"), std::string::npos);
  EXPECT_NE(problemOf(1, 1, 4, 0).find("maps.channels: found 4"), std::string::npos);
  EXPECT_NE(problemOf(1, 2, 3, 0, 16).find("maps.cells of higher view maps: found 16"), std::string::npos);
  EXPECT_NE(problemOf(1, 0, 3, (size_t{256} << 20) + 1).find("maps: 268.435 MB are more"), std::string::npos);
}

TEST(ObjectPage, RefusesMapsThatFillMoreThanTheLayersOfATexture) {
  lfm::LightFieldMaps maps;
  maps.samples = 6; // two maps in 7 x 6 texels
  maps.mesh.triangles.resize(1);
  maps.channels = 3;
  constexpr size_t kHeld = size_t{2} * 256 * (2048 / 7) * (2048 / 6);
  maps.mean.maps.count = kHeld;
  EXPECT_NO_THROW(requireHeldByPage(maps));
  ++maps.mean.maps.count;
  EXPECT_THROW(requireHeldByPage(maps), Error);
}

TEST(PageMark, KeepsWhatIsNotGivenForTheSameObjectAlone) {
  const PageMark earlier{"cat", "A cat", "(c) us", 4.0};
  const PageMark same = markOf({"cat", "", "", {}}, earlier, "folder");
  EXPECT_EQ(same.title, "A cat");
  EXPECT_EQ(same.credit, "(c) us");
  EXPECT_EQ(same.scale, 4.0);
  const PageMark given = markOf({"cat", "Felis", "", 2.0}, earlier, "folder");
  EXPECT_EQ(given.title, "Felis");
  EXPECT_EQ(given.scale, 2.0);
  const PageMark other = markOf({"dog", "", "", {}}, earlier, "folder");
  EXPECT_EQ(other.title, "folder");
  EXPECT_EQ(other.credit, "");
  EXPECT_FALSE(other.scale);
}

TEST(PageFolder, KnowsWhatExportsWrite) {
  for (const char* own :
       {"index.html", "relit.js", "object.js", "term0.js", "term12.js", "annotations.1.json"})
    EXPECT_TRUE(isOfPage(own)) << own;
  for (const char* other : {"object.html", "term.js", "termite.js", "README", "term1.json"})
    EXPECT_FALSE(isOfPage(other)) << other;
}

} // namespace
} // namespace surflect::web
