#include "render/evaluation/true_frames.h"

#include <gtest/gtest.h>

namespace surflect::evaluation {
namespace {

// Three frames, of which the first and the last have masks.
capture::Capture someMasks() {
  capture::Capture capture;
  for (const char* name : {"a", "b", "c"}) capture.views.push_back({name, {}});
  capture.frames = {{.view = 0, .mask = "a.png"}, {.view = 1}, {.view = 2, .mask = "c.png"}};
  return capture;
}

TEST(TrueFrames, FramesWithoutAMaskShowNoObjectWhereOthersHaveOne) {
  const capture::Capture known = withKnownObject(someMasks());
  ASSERT_EQ(known.frames.size(), 2u);
  EXPECT_EQ(known.views[known.frames[0].view].identity, "a");
  EXPECT_EQ(known.views[known.frames[1].view].identity, "c");
}

TEST(TrueFrames, GeometryOrNoMaskAtAllKeepEveryFrame) {
  capture::Capture withMesh = someMasks();
  withMesh.geometry = "mesh.ply";
  EXPECT_EQ(withKnownObject(withMesh).frames.size(), 3u);
  capture::Capture bare = someMasks();
  for (capture::Frame& frame : bare.frames) frame.mask.clear();
  EXPECT_EQ(withKnownObject(bare).frames.size(), 3u);
}

} // namespace
} // namespace surflect::evaluation
