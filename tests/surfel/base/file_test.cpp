#include "surfel/base/file.h"

#include "surfel/base/error.h"
#include "tests/srf/image/files.h"
#include "tests/support/patience.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <random>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace surflect {
namespace {

namespace fs = std::filesystem;

class File : public ::testing::Test {
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

TEST_F(File, CopiesAreEqualAndNeverReplaceAnything) {
  for (const size_t size : {size_t{0}, size_t{65536}, size_t{300000}}) {
    const std::string content(size, 'x');
    writeFileAtomically(folder / "a", content);
    copyFile(folder / "a", folder / "b");
    EXPECT_EQ(readFile(folder / "b"), content);
    EXPECT_THROW(copyFile(folder / "a", folder / "b"), Error);
    fs::remove(folder / "b");
  }
  EXPECT_THROW(copyFile(folder / "none", folder / "b"), Error);
  EXPECT_FALSE(fs::exists(folder / "b"));
}

TEST_F(File, CopiesCanBeReadByAllWhateverTheUmask) {
  writeFileAtomically(folder / "a", std::string("x"));
  const mode_t before = ::umask(0077);
  copyFile(folder / "a", folder / "b");
  ::umask(before);
  EXPECT_EQ(fs::status(folder / "b").permissions(), fs::perms(0644));
  EXPECT_EQ(fs::status(folder / "a").permissions(), fs::perms(0644));
}

TEST_F(File, ReadingAndCopyingStopWhenAskedTo) {
  writeFileAtomically(folder / "a", std::string(1 << 20, 'x'));
  for (const int questions : {0, 10}) {
    EXPECT_THROW(readFile(folder / "a", kLargestFile, Patience(questions).progress()), Cancelled);
    EXPECT_THROW(
        copyFile(folder / "a", folder / ("b" + std::to_string(questions)), Patience(questions).progress()),
        Cancelled);
  }
}

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
    EXPECT_FALSE(fs::exists(folder / "a"));
  }
  EXPECT_EQ(entries(), 0u);
}

// A killed process leaves temporaries of a batch, and whole files from the first on.
TEST_F(File, ABatchIsCommittedInOrderUpToTheFileThatFails) {
  const auto begun = [&](const char* name) {
    auto file = std::make_unique<AtomicFile>(folder / name);
    file->write(std::string_view(name));
    return file;
  };
  std::vector<std::unique_ptr<AtomicFile>> files;
  for (const char* name : {"a", "b", "c"}) files.push_back(begun(name));
  fs::create_directory(folder / "b"); // after it was found replaceable
  try {
    AtomicFile::commit(files);
    FAIL() << "renamed to a folder";
  } catch (const Error& error) {
    EXPECT_EQ(error.file(), (folder / "b").string());
  }
  files.clear();
  EXPECT_EQ(readFile(folder / "a"), "a");
  EXPECT_EQ(entries(), 2u);
  fs::remove(folder / "b");
  for (const char* name : {"b", "c"}) files.push_back(begun(name));
  EXPECT_EQ(entries(), 3u);
  EXPECT_FALSE(fs::exists(folder / "b") || fs::exists(folder / "c")); // until all are written
  AtomicFile::commit(files);
  EXPECT_EQ(readFile(folder / "b"), "b");
  EXPECT_EQ(readFile(folder / "c"), "c");
}

TEST_F(File, TheTemporaryStandsBesideTheTarget) { // so that renaming is atomic
  const AtomicFile file(folder / "a");
  ASSERT_EQ(entries(), 1u);
  const std::string name = fs::directory_iterator(folder)->path().filename().string();
  EXPECT_TRUE(name.starts_with("a.") && name.ends_with(".tmp")) << name;
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

TEST_F(File, WhatKilledProcessesLeftIsRemovedAndNothingElse) {
  const auto isA = [](const std::string& target) { return target == "a"; };
  for (const char* name : {"a.AbC123.tmp", "b.AbC123.tmp", "a.tmp", "a.AbC12.tmp", "a.AbC-23.tmp", "a"})
    writeFileAtomically(folder / name, std::string_view("x"));
  const AtomicFile alive(folder / "a");
  removeAbandoned(folder, isA);
  EXPECT_FALSE(fs::exists(folder / "a.AbC123.tmp"));
  EXPECT_EQ(entries(), 6u); // five of the names and the living temporary
  removeAbandoned(folder / "missing", isA);
}

TEST_F(File, AWriterThatDiesLeavesATemporaryThatIsAbandoned) {
  const pid_t child = ::fork();
  if (child == 0) {
    AtomicFile file(folder / "a");
    file.write(std::string_view("half"));
    ::_exit(0); // as if killed: no destructor runs
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(entries(), 1u);
  removeAbandoned(folder, [](const std::string& target) { return target == "a"; });
  EXPECT_EQ(entries(), 0u);
}

TEST_F(File, AFullDiskIsAnErrorThatNamesTheTargetAndLeavesNothing) {
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit limit{100000, 100000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    ::signal(SIGXFSZ, SIG_IGN);
    try {
      writeFileAtomically(folder / "a", std::string(100001, 'x'));
    } catch (const Error& error) {
      ::_exit(error.file() == (folder / "a").string() && entries() == 0 ? 0 : 1);
    }
    ::_exit(2);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

TEST_F(File, WhatIsNoRegularFileIsRefusedAtOnce) {
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (const fs::path& path : {fs::path("/dev/zero"), fs::path("/dev/null"), folder / "pipe", folder}) {
    EXPECT_THROW(readFile(path), Error) << path;
    EXPECT_THROW(readFileStart(path, 10), Error) << path;
  }
}

TEST_F(File, OnlyRegularFilesAreReplaced) {
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  fs::create_directory(folder / "empty");
  for (const fs::path& path : {fs::path("/dev/null"), folder / "pipe", folder / "empty"})
    EXPECT_NE(
        image::errorOf([&] { writeFileAtomically(path, "x"); }).find(path.string() + ": cannot write ("),
        std::string::npos);
  EXPECT_TRUE(fs::is_directory(folder / "empty"));
  EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
  fs::create_symlink("file", folder / "link");
  for (int i = 0; i < 2; ++i) writeFileAtomically(folder / "file", "x");
  EXPECT_NO_THROW(writeFileAtomically(folder / "link", "y"));
  EXPECT_NO_THROW(writeFileAtomically(folder / "new", "z"));
}

TEST_F(File, AFileAboveTheLimitIsRefusedUnread) {
  writeFileAtomically(folder / "a", std::string(1000, 'x'));
  EXPECT_EQ(readFile(folder / "a", 1000).size(), 1000u);
  EXPECT_THROW(readFile(folder / "a", 999), Error);
  ASSERT_EQ(::truncate((folder / "a").c_str(), off_t{1} << 40), 0); // a hole: reading it would fill memory
  EXPECT_THROW(readFile(folder / "a"), Error);
}

TEST_F(File, TheStartOfAFileIsReadAlone) {
  writeFileAtomically(folder / "a", std::string_view("start and rest"));
  EXPECT_EQ(readFileStart(folder / "a", 5), "start");
  EXPECT_EQ(readFileStart(folder / "a", 100), "start and rest");
}

TEST_F(File, AnOpenFileIsReadInPiecesUntilItBecomesShorter) {
  writeFileAtomically(folder / "a", std::string_view("start and rest"));
  OpenFile opened(folder / "a");
  const OpenFile file(std::move(opened));
  EXPECT_EQ(file.bytes(), 14u);
  const auto piece = [&](uint64_t position, size_t size) {
    std::string text(size, ' ');
    file.read(position, std::as_writable_bytes(std::span(text)));
    return text;
  };
  EXPECT_EQ(piece(6, 3), "and");
  EXPECT_EQ(piece(0, 14), "start and rest");
  EXPECT_EQ(piece(14, 0), "");
  fs::resize_file(folder / "a", 8);
  EXPECT_EQ(image::errorOf([&] { piece(6, 3); }), (folder / "a").string() + ": has become shorter");
  EXPECT_THROW(OpenFile(folder / "none"), Error);
  EXPECT_THROW(OpenFile{folder}, Error);
}

TEST_F(File, AnOpenFileThatIsWrittenToIsRefusedAndOneThatIsReplacedStays) {
  writeFileAtomically(folder / "a", std::string_view("first"));
  const OpenFile file(folder / "a");
  const auto all = [&] {
    std::string text(5, ' ');
    file.read(0, std::as_writable_bytes(std::span(text)));
    return text;
  };
  writeFileAtomically(folder / "a", std::string_view("other"));
  EXPECT_EQ(all(), "first");
  fs::last_write_time(folder / "a",
                      fs::last_write_time(folder / "a") - std::chrono::hours(1)); // clocks are coarse
  const OpenFile now(folder / "a");
  std::ofstream(folder / "a") << "third";
  std::string text(5, ' ');
  EXPECT_EQ(image::errorOf([&] { now.read(0, std::as_writable_bytes(std::span(text))); }),
            (folder / "a").string() + ": has been written to since it was opened");
}

TEST_F(File, ReadingAFolderIsAnError) { EXPECT_THROW(readFile(folder), Error); }

} // namespace
} // namespace surflect
