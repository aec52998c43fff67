#include "bench/doll/fewer_views.h"

#include "bench/doll/doll_model.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace surflect::bench {
namespace {

// Cameras at these directions from the only surfel.
model::Model seenFrom(const std::vector<capture::Camera<AcquisitionSpace>>& cameras) {
  model::Model model;
  model.cloud.p0.emplace_back(0.f, 0.f, 0.5f);
  for (const auto& camera : cameras) model.rig.views.push_back({"", camera});
  return model;
}

using Directions = std::vector<Vec3<double>>;

Directions towards(const model::Model& model) {
  Directions result;
  for (const capture::View& view : model.rig.views)
    result.push_back((view.camera.center().raw() - Vec3<double>(0, 0, 0.5)).normalized());
  return result;
}

// The largest angle from any of `all` to the nearest of those chosen, radians.
double largestGap(const Directions& all, const Directions& chosen) {
  double gap = 0;
  for (const auto& direction : all) {
    double nearest = -1;
    for (const auto& other : chosen) nearest = std::max(nearest, direction.dot(other));
    gap = std::max(gap, std::acos(std::min(1.0, nearest)));
  }
  return gap;
}

// About as well as so many that are placed for it.
TEST(FewerViews, SurroundTheObjectEvenly) {
  const model::Model model = seenFrom(dollCameras({.views = 432}));
  const Directions all = towards(model);
  for (const size_t count : {216, 108, 54}) {
    Directions chosen;
    for (const size_t view : evenViews(model, count)) chosen.push_back(all[view]);
    ASSERT_EQ(chosen.size(), count);
    const Directions placed = towards(seenFrom(dollCameras({.views = count})));
    EXPECT_LT(largestGap(all, chosen), 1.1 * largestGap(all, placed)) << count;
  }
}

TEST(FewerViews, AreThoseOfMoreViews) {
  const model::Model model = seenFrom(dollCameras({.views = 60}));
  const auto many = evenViews(model, 30), few = evenViews(model, 15), all = evenViews(model, 60);
  EXPECT_TRUE(std::ranges::includes(many, few));
  EXPECT_TRUE(std::ranges::includes(all, many));
  EXPECT_EQ(std::ranges::adjacent_find(all), all.end());
}

TEST(FewerViews, KeepWhatBelongsToThem) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "FewerViews";
  std::filesystem::remove_all(folder);
  writeDollModel(folder, {.surfels = 500, .views = 9, .lights = 4, .width = 64, .height = 80});
  const model::Model model = model::openModel(folder);
  const std::vector<size_t> kept{0, 3, 7};
  const model::Model part = withViews(model, kept);
  ASSERT_EQ(part.rig.views.size(), 3u);
  ASSERT_EQ(part.files.size(), 3u);
  ASSERT_EQ(part.columns.size(), 3u);
  ASSERT_EQ(part.rig.frames.size(), 12u);
  ASSERT_EQ(part.fades.views, 3u);
  ASSERT_EQ(part.fades.values.size(), 3 * model.cloud.size());
  EXPECT_TRUE(part.isFullProduct);
  EXPECT_EQ(part.cloud.p0, model.cloud.p0);
  for (size_t i = 0; i < kept.size(); ++i) {
    EXPECT_EQ(part.rig.views[i].identity, model.rig.views[kept[i]].identity);
    EXPECT_EQ(part.files[i].checksum(), model.files[kept[i]].checksum());
    EXPECT_EQ(part.columns[i], model.columns[kept[i]]);
    for (size_t surfel = 0; surfel < model.cloud.size(); ++surfel)
      ASSERT_EQ(part.fades.of(surfel)[i], model.fades.of(surfel)[kept[i]]);
  }
  for (const capture::Frame& frame : part.rig.frames)
    EXPECT_EQ(frame.picture, model::viewFilePath(kept[frame.view])); // as the doll's rig names them
  std::filesystem::remove_all(folder);
}

} // namespace
} // namespace surflect::bench
