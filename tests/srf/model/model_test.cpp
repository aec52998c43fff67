#include "srf/model/model.h"

#include "srf/model/manifest.h"
#include "srf/weights/shadow_state.h"
#include "surfel/base/file.h"
#include "tests/support/patience.h"
#include "tests/support/synthetic_capture.h"

#include <tbb/global_control.h>

#include <cstring>
#include <iomanip>
#include <limits>
#include <sstream>

namespace surflect::model {
namespace {

using studio::PackedStudio;
using studio::Studio;

const Studio smallStudio{.cameras = 4, .lights = 3, .size = 24};
constexpr size_t fewSurfels = 150;

void readEverything(const std::filesystem::path& folder) {
  const Model model = openModel(folder);
  for (const codec::ViewFile& file : model.files)
    for (uint32_t block = 0; block < file.blockCount(); ++block) file.read(block);
}

SurfelCloud randomCloud(size_t count, std::mt19937& random) {
  std::uniform_real_distribution<float> number(-1, 1);
  SurfelCloud cloud;
  for (size_t i = 0; i < count; ++i) {
    cloud.p0.push_back({number(random), number(random), number(random)});
    cloud.r0.push_back({number(random), number(random), static_cast<float>(i % 2)});
    cloud.radius.push_back(number(random));
    cloud.coverage.push_back(number(random));
  }
  return cloud;
}

TEST(Model, WhatIsWrittenIsReadBackEqual) {
  const PackedStudio packed(smallStudio, fewSurfels);
  std::mt19937 random(1);
  const SurfelCloud cloud = randomCloud(333, random);
  weights::VisibilityWeights visibility{4, std::vector<uint8_t>(4 * cloud.size())};
  for (auto& fade : visibility.values) fade = static_cast<uint8_t>(random());
  const auto copy = packed.folder / "copy";
  std::filesystem::create_directories(copy);
  std::filesystem::copy(packed.model.folder / "views", copy / "views");
  Model made =
      makeModel(copy, {packed.model.rig, cloud, visibility, 0.7, 0.02, {5, weights::LightFit::plane}});
  made.interpolation = {weights::Interpolation::kriging, 0.4f, true};
  writeModel(made);

  const Model model = openModel(copy);
  EXPECT_EQ(model.cloud.p0, cloud.p0);
  EXPECT_EQ(model.cloud.radius, cloud.radius);
  EXPECT_EQ(model.cloud.coverage, cloud.coverage);
  for (size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_EQ(model.cloud.r0[i].x, cloud.r0[i].x);
    EXPECT_EQ(model.cloud.r0[i].y, cloud.r0[i].y);
    EXPECT_EQ(model.cloud.r0[i].lower, cloud.r0[i].lower);
  }
  ASSERT_TRUE(model.levels);
  EXPECT_GT(model.levels->count, 1u);
  EXPECT_EQ(*model.levels, levelsOfDetail(cloud));
  EXPECT_EQ(model.visibility.views, visibility.views);
  EXPECT_EQ(model.visibility.values, visibility.values);
  ASSERT_TRUE(model.lightVisibility);
  EXPECT_EQ(model.lightVisibility->values,
            weights::shadowStates(cloud, occludersOf(cloud, *model.levels), packed.model.rig.lights).values);
  EXPECT_EQ(model.white, 0.7);
  EXPECT_EQ(model.lightBlend, (weights::LightBlend{5, weights::LightFit::plane}));
  EXPECT_EQ(model.interpolation, made.interpolation);
  EXPECT_EQ(model.tolerance, 0.02);
  EXPECT_NE(model.identity, packed.model.identity);
}

TEST(Model, TheRigIsThatOfTheCapture) {
  const PackedStudio packed(smallStudio, fewSurfels);
  const capture::Capture &rig = packed.model.rig, &capture = packed.capture;
  EXPECT_EQ(rig.lights, capture.lights);
  ASSERT_EQ(rig.views.size(), capture.views.size());
  for (size_t v = 0; v < rig.views.size(); ++v) {
    EXPECT_EQ(rig.views[v].identity, capture.views[v].identity);
    EXPECT_EQ(rig.views[v].camera.lens, capture.views[v].camera.lens);
    const auto &got = rig.views[v].camera.cameraFromWorld, &wanted = capture.views[v].camera.cameraFromWorld;
    EXPECT_NEAR((got.rotation() - wanted.rotation()).norm(), 0, 2e-15);
    EXPECT_NEAR((got.translation() - wanted.translation()).norm(), 0, 1e-14);
    EXPECT_EQ(packed.model.columns[v], (std::vector<uint32_t>{0, 1, 2}));
  }
  EXPECT_TRUE(packed.model.isFullProduct);
}

TEST(Model, WithoutOneFrameTheProductIsNotFull) {
  Studio gap = smallStudio;
  gap.split = [](size_t view, size_t light) {
    return view == 2 && light == 1 ? std::nullopt : std::optional(capture::Split::train);
  };
  const PackedStudio packed(gap, fewSurfels);
  EXPECT_FALSE(packed.model.isFullProduct);
  EXPECT_EQ(packed.model.columns[1], (std::vector<uint32_t>{0, 1, 2}));
  EXPECT_EQ(packed.model.columns[2], (std::vector<uint32_t>{0, 2}));
}

TEST(Model, EveryCorruptionIsRefusedAndNamesTheFile) {
  const PackedStudio packed(smallStudio, fewSurfels);
  const auto folder = packed.model.folder;
  std::mt19937 random(2);
  for (const std::string name : {"manifest.json", "transforms.json", "surfels.ply", "levels.bin",
                                 "shadows.bin", "fades.bin", "views/0001.srfb"}) {
    const std::string whole = readFile(folder / name);
    const auto isRefused = [&](const std::string& damaged) {
      image::writeBytes(folder / name, damaged);
      const std::string line = image::errorOf([&] { readEverything(folder); });
      EXPECT_NE(line.find(name), std::string::npos) << line;
    };
    const size_t end = whole.size() - 1; // the manifest is complete without its final line feed
    for (const size_t length : {size_t{0}, size_t{1}, size_t{40}, end / 2, random() % end, end - 1})
      isRefused(whole.substr(0, std::min(length, end - 1)));
    for (int flip = 0; flip < 40; ++flip) {
      std::string damaged = whole;
      damaged[random() % whole.size()] ^= static_cast<char>(1 << random() % 8);
      isRefused(damaged);
    }
    std::filesystem::remove(folder / name);
    const std::string line = image::errorOf([&] { readEverything(folder); });
    EXPECT_NE(line.find(name), std::string::npos) << line;
    image::writeBytes(folder / name, whole);
  }
  readEverything(folder);
}

// Files are read side by side; nobody should see that in a message.
TEST(Model, OfSeveralFaultsTheFirstIsReportedForAnyNumberOfThreads) {
  const PackedStudio packed(smallStudio, fewSurfels);
  const auto folder = packed.model.folder;
  const std::vector<std::string> names = {"transforms.json", "surfels.ply",     "fades.bin",
                                          "levels.bin",      "views/0001.srfb", "views/0002.srfb"};
  std::vector<std::string> whole;
  for (const std::string& name : names) {
    whole.push_back(readFile(folder / name));
    std::string damaged = whole.back();
    damaged[damaged.size() / 2] ^= 1;
    if (name.starts_with("views")) damaged[30] ^= 1;
    image::writeBytes(folder / name, damaged);
  }
  for (size_t i = 0; i < names.size(); ++i) {
    for (const size_t threads : {1, 2}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      const std::string line = image::errorOf([&] { openModel(folder); });
      EXPECT_EQ(line.find((folder / names[i]).string() + ": "), 0u) << line;
    }
    image::writeBytes(folder / names[i], whole[i]);
  }
  openModel(folder);
}

// Replaces surfels.ply, and its checksum in the manifest.
void replaceCloud(const std::filesystem::path& folder, std::string_view content) {
  const auto path = folder / "manifest.json";
  Manifest manifest = parseManifest(readFile(path), path);
  manifest.cloud = hex(contentHash(std::as_bytes(std::span(content))));
  image::writeBytes(folder / "surfels.ply", std::string(content));
  image::writeBytes(path, manifestText(manifest));
}

// surfels.ply as text, in double precision and another order of columns, and with a column more.
std::string cloudText(const SurfelCloud& cloud) {
  std::ostringstream text;
  text << std::setprecision(9) << "ply\nformat ascii 1.0\nelement vertex " << cloud.size() << "\n";
  for (const char* name : {"coverage", "radius", "lower", "quality", "r0y", "r0x", "z", "y", "x"})
    text << "property double " << name << "\n";
  text << "end_header\n";
  for (size_t i = 0; i < cloud.size(); ++i) {
    const auto& p = cloud.p0[i];
    const auto& r = cloud.r0[i];
    for (const float v : {cloud.coverage[i], cloud.radius[i], r.lower, 7.f, r.y, r.x, p.z(), p.y(), p.x()})
      text << v << " ";
    text << "\n";
  }
  return text.str();
}

TEST(Model, SurfelsMayBeInAnyFormOfPly) {
  const PackedStudio packed(smallStudio, fewSurfels);
  const SurfelCloud& cloud = packed.model.cloud;
  replaceCloud(packed.model.folder, cloudText(cloud));
  const SurfelCloud read = openModel(packed.model.folder).cloud;
  EXPECT_EQ(read.p0, cloud.p0);
  EXPECT_EQ(read.radius, cloud.radius);
  EXPECT_EQ(read.coverage, cloud.coverage);
  EXPECT_TRUE(std::ranges::equal(read.r0, cloud.r0, [](const auto& a, const auto& b) {
    return a.x == b.x && a.y == b.y && a.lower == b.lower;
  }));
}

TEST(Model, SurfelsThatAreNotFiniteOrIncompleteAreRefusedInAnyFormOfPly) {
  const PackedStudio packed(smallStudio, fewSurfels);
  const auto folder = packed.model.folder, path = folder / "surfels.ply";
  const auto errorOf = [&](const std::string& content) {
    replaceCloud(folder, content);
    return image::errorOf([&] { openModel(folder); });
  };
  const std::string written = readFile(path);
  const auto withoutRadius = [](std::string content) {
    return content.replace(content.find(" radius\n"), 8, " radios\n");
  };
  EXPECT_EQ(errorOf(withoutRadius(written)),
            path.string() + ": vertex: found none, expected a number property 'radius'");
  std::string endless = written; // the last coverage
  const float infinity = std::numeric_limits<float>::infinity();
  std::memcpy(&endless[endless.size() - sizeof(float)], &infinity, sizeof(float));
  EXPECT_EQ(errorOf(endless), path.string() + ": vertex[" + std::to_string(packed.model.cloud.size() - 1) +
                                  "].coverage: found inf, expected a finite number");
  SurfelCloud cloud = packed.model.cloud;
  EXPECT_EQ(errorOf(withoutRadius(cloudText(cloud))),
            path.string() + ": vertex: found none, expected a number property 'radius'");
  cloud.p0[3] = {0, infinity, 0};
  EXPECT_EQ(errorOf(cloudText(cloud)), path.string() + ": vertex[3].y: found inf, expected a finite number");
}

TEST(Model, CountsOfTheManifestAreCheckedAgainstTheFiles) {
  const PackedStudio packed(smallStudio, fewSurfels);
  const auto folder = packed.model.folder, path = folder / "manifest.json";
  const Manifest right = parseManifest(readFile(path), path);
  const auto errorWith = [&](size_t surfels, size_t views, size_t lights) {
    Manifest wrong = right;
    wrong.surfels += surfels, wrong.views += views, wrong.lights += lights;
    image::writeBytes(path, manifestText(wrong));
    return image::errorOf([&] { openModel(folder); });
  };
  const auto stated = [&](const std::string& field, size_t count) {
    return path.string() + ": " + field + ": found " + std::to_string(count + 1) + ", expected " +
           std::to_string(count);
  };
  EXPECT_EQ(errorWith(1, 1, 1), stated("surfels", right.surfels));
  EXPECT_EQ(errorWith(0, 1, 1), stated("views", right.views));
  EXPECT_EQ(errorWith(0, 0, 1), stated("lights", right.lights));
  EXPECT_NE(errorWith(~size_t{0} - right.surfels, 0, 0).find("surfels: found 18446744073709551615"),
            std::string::npos);
}

TEST(Model, OpeningStopsWheneverItIsAskedTo) {
  const PackedStudio packed(smallStudio, fewSurfels);
  expectStopsWhenAsked([&](const Progress& progress) { openModel(packed.model.folder, progress); },
                       1 + 4 + 4); // at the start, of each file with a checksum, of each view
}

// Models packed by earlier versions.
TEST(Model, WithoutLevelsIsOpenedToo) {
  const PackedStudio packed(smallStudio, fewSurfels);
  const auto path = packed.model.folder / "manifest.json";
  Manifest manifest = parseManifest(readFile(path), path);
  manifest.levels.clear();
  image::writeBytes(path, manifestText(manifest));
  std::filesystem::remove(packed.model.folder / "levels.bin");
  const Model model = openModel(packed.model.folder);
  EXPECT_FALSE(model.levels);
  EXPECT_EQ(model.cloud.radius, packed.model.cloud.radius);
}

TEST(Model, AnUnfinishedFolderSaysSo) {
  const PackedStudio packed(smallStudio, fewSurfels);
  std::filesystem::remove(packed.model.folder / "manifest.json");
  const std::string line = image::errorOf([&] { openModel(packed.model.folder); });
  EXPECT_NE(line.find("manifest.json: unfinished model: run the same pack again"), std::string::npos) << line;
}

TEST(Model, AViewFileOfAnotherModelIsRefused) {
  const PackedStudio packed(smallStudio, fewSurfels);
  Studio other = smallStudio;
  other.lights = 2;
  const PackedStudio foreign(other, fewSurfels);
  const auto path = packed.model.folder / "views/0003.srfb";
  image::writeBytes(path, readFile(foreign.model.folder / "views/0003.srfb"));
  const std::string line = image::errorOf([&] { openModel(packed.model.folder); });
  EXPECT_EQ(line.find(path.string() + ": checksum: found "), 0u) << line;
}

} // namespace
} // namespace surflect::model
