#include "surfel/file.h"

#include "surfel/error.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect {
namespace {

namespace fs = std::filesystem;

class File : public testing::Test {
protected:
  File() {
    std::string name = (fs::temp_directory_path() / "surflect_file_XXXXXX").string();
    folder = ::mkdtemp(name.data());
  }
  ~File() override { fs::remove_all(folder); }

  size_t entries() const {
    return static_cast<size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  }

  fs::path folder;
};

TEST_F(File, WhatIsWrittenIsReadBack) {
  std::mt19937 random(1);
  for (const size_t size : {size_t{0}, size_t{1}, size_t{65536}, size_t{65537}, size_t{300000}}) {
    std::string content(size, '\0');
    for (char& c : content) c = static_cast<char>(random());
    writeFileAtomically(folder / "a", content);
    EXPECT_EQ(readFile(folder / "a"), content);
  }
  EXPECT_EQ(entries(), 1u);
}

TEST_F(File, ReadersSeeTheOldContentUntilCommit) {
  writeFileAtomically(folder / "a", std::string_view("old"));
  AtomicFile file(folder / "a");
  file.write(std::string_view("new"));
  EXPECT_EQ(readFile(folder / "a"), "old");
  file.commit();
  EXPECT_EQ(readFile(folder / "a"), "new");
}

TEST_F(File, TheDestructorDropsWhatWasNotCommitted) {
  {
    AtomicFile file(folder / "a");
    file.write(std::string_view("half"));
    EXPECT_EQ(entries(), 1u);
    EXPECT_TRUE(fs::exists(file.temporaryPath()));
  }
  EXPECT_EQ(entries(), 0u);
}

TEST_F(File, TheTemporaryStandsBesideTheTarget) {
  const AtomicFile file(folder / "a");
  EXPECT_EQ(file.temporaryPath().parent_path(), folder); // so that renaming is atomic
}

TEST_F(File, AMissingFolderIsAnErrorThatNamesTheTarget) {
  const fs::path target = folder / "missing" / "a";
  try {
    AtomicFile file(target);
    FAIL() << "opened";
  } catch (const Error& error) {
    EXPECT_EQ(error.file(), target.string());
  }
}

TEST_F(File, ReadingAMissingFileIsAnErrorThatNamesIt) {
  try {
    readFile(folder / "nothing");
    FAIL() << "read";
  } catch (const Error& error) {
    EXPECT_EQ(error.file(), (folder / "nothing").string());
  }
}

TEST_F(File, ReadingAFolderIsAnError) { EXPECT_THROW(readFile(folder), Error); }

} // namespace
} // namespace surflect
