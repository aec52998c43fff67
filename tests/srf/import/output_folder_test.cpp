#include "srf/import/output_folder.h"

#include "tests/srf/image/files.h"

#include <optional>
#include <set>
#include <string_view>
#include <sys/wait.h>

namespace surflect::importers {
namespace {

namespace fs = std::filesystem;

std::set<std::string> namesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
  return names;
}

// Leaves the remains of a process that was killed while it filled the folder.
void leaveUnfinished(const fs::path& target) {
  const pid_t child = ::fork();
  if (child == 0) {
    const OutputFolder folder(target);
    fs::create_directories(folder.temporaryPath() / "images");
    std::ofstream(folder.temporaryPath() / "images/a.png") << "half a pic";
    ::_exit(0); // without destructors
  }
  int status = 1;
  ::waitpid(child, &status, 0);
  ASSERT_EQ(status, 0);
}

TEST(OutputFolder, AppearsWholeAndWithNothingElse) {
  const image::TemporaryFolder parent;
  OutputFolder folder(parent / "capture/");
  std::ofstream(folder.temporaryPath() / "a") << "b";
  EXPECT_FALSE(fs::exists(parent / "capture"));
  folder.commit();
  EXPECT_EQ(namesIn(parent.path()), std::set<std::string>{"capture"});
  EXPECT_EQ(namesIn(parent / "capture"), std::set<std::string>{"a"});
}

TEST(OutputFolder, WithoutCommitNothingStays) {
  const image::TemporaryFolder parent;
  {
    const OutputFolder folder(parent / "capture");
    std::ofstream(folder.temporaryPath() / "a") << "b";
  }
  EXPECT_TRUE(fs::is_empty(parent.path()));
}

TEST(OutputFolder, WhatKilledProcessesLeftOfTheTargetIsRemoved) {
  const image::TemporaryFolder parent;
  leaveUnfinished(parent / "capture");
  leaveUnfinished(parent / "other");
  fs::create_directory(parent / "capture.tmp.AbC123"); // killed before it was marked
  ASSERT_EQ(namesIn(parent.path()).size(), 3u);
  OutputFolder(parent / "capture").commit();
  const auto left = namesIn(parent.path());
  EXPECT_EQ(left.size(), 2u);
  EXPECT_TRUE(left.contains("capture"));
  EXPECT_TRUE(left.lower_bound("other.tmp.")->starts_with("other.tmp."));
}

TEST(OutputFolder, WhatALivingProcessFillsStays) {
  const image::TemporaryFolder parent;
  const OutputFolder first(parent / "capture");
  std::ofstream(first.temporaryPath() / "a") << "b";
  OutputFolder second(parent / "capture");
  EXPECT_NE(first.temporaryPath(), second.temporaryPath());
  second.commit();
  EXPECT_TRUE(fs::exists(first.temporaryPath() / "a"));
}

TEST(OutputFolder, FoldersOfPeopleStayWhateverTheirName) {
  const image::TemporaryFolder parent;
  leaveUnfinished(parent / "elsewhere");
  const fs::path marked = parent / *namesIn(parent.path()).begin();
  for (const char* name : {"capture.tmp.backup", "capture.backup", "capture.tmp", "capture2.tmp.AbC123"}) {
    fs::create_directory(parent / name);
    std::ofstream(parent / name / "letter.txt") << "dear";
  }
  fs::create_directory_symlink(marked, parent / "capture.tmp.AbC123");
  std::ofstream(parent / "capture.tmp.AbC124") << "a file";
  const auto before = namesIn(parent.path());
  { const OutputFolder folder(parent / "capture"); }
  EXPECT_EQ(namesIn(parent.path()), before);
  EXPECT_TRUE(fs::exists(parent / "capture.tmp.backup/letter.txt"));
  EXPECT_TRUE(fs::exists(marked / "images/a.png"));
}

constexpr auto isPage = [](std::string_view name) { return name == "mark" || name == "page"; };

// A folder of earlier output: a mark and a page.
void writeEarlier(const fs::path& folder) {
  fs::create_directory(folder);
  std::ofstream(folder / "mark") << "1";
  std::ofstream(folder / "page") << "old";
}

TEST(OutputFolder, EarlierOutputIsReplacedWhole) {
  const image::TemporaryFolder parent;
  writeEarlier(parent / "site");
  OutputFolder folder(parent / "site", {"mark", isPage});
  std::ofstream(folder.temporaryPath() / "mark") << "2";
  folder.commit();
  EXPECT_EQ(namesIn(parent.path()), std::set<std::string>{"site"});
  EXPECT_EQ(namesIn(parent / "site"), std::set<std::string>{"mark"});
}

TEST(OutputFolder, WhatLiesBesideEarlierOutputIsNeverRemoved) {
  const image::TemporaryFolder parent;
  writeEarlier(parent / "site");
  OutputFolder folder(parent / "site", {"mark", isPage});
  std::ofstream(folder.temporaryPath() / "mark") << "2";
  std::ofstream(parent / "site/README") << "own"; // while the new one is made
  const auto refusal = [&](const auto& work) {
    try {
      work();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal([&] { folder.commit(); }).find("site/README: is not of the earlier output"),
            std::string::npos);
  EXPECT_NE(refusal([&] {
              OutputFolder(parent / "site", {"mark", isPage});
            }).find("README"),
            std::string::npos);
  EXPECT_EQ(namesIn(parent / "site"), (std::set<std::string>{"README", "mark", "page"}));
}

TEST(OutputFolder, ALinkToEarlierOutputStaysALink) {
  const image::TemporaryFolder parent;
  writeEarlier(parent / "site");
  fs::create_directory_symlink("site", parent / "link");
  OutputFolder folder(parent / "link", {"mark", isPage});
  std::ofstream(folder.temporaryPath() / "mark") << "2";
  folder.commit();
  EXPECT_TRUE(fs::is_symlink(parent / "link"));
  EXPECT_EQ(namesIn(parent / "site"), std::set<std::string>{"mark"});
  fs::create_symlink("nowhere", parent / "loose");
  EXPECT_THROW(OutputFolder(parent / "loose"), Error);
}

} // namespace
} // namespace surflect::importers
