#include "render/film_writer.h"

#include "surfel/error.h"
#include "tests/srf/image/files.h"

#include <atomic>
#include <map>

namespace surflect {
namespace {

constexpr int kFrames = 12; // more than share a commit

class WrittenFilm : public testing::Test {
protected:
  static Film film(int frame) {
    const auto seed = static_cast<unsigned>(frame);
    return {randomImage(40, 30, 4, 0, 1, seed), {{"stretch", randomImage(40, 30, 1, 1, 2, seed)}}};
  }
  std::filesystem::path picture(int frame) const { return folder / (std::to_string(frame) + ".exr"); }
  std::filesystem::path preview(int frame) const { return folder / (std::to_string(frame) + ".png"); }
  void write(FilmWriter& writer, int frame) const {
    writer.write({picture(frame), {{"surflect.frame", std::to_string(frame)}}, preview(frame), 0.5},
                 film(frame));
  }
  std::map<std::string, std::string> content() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
      if (entry.is_regular_file()) files[entry.path().filename().string()] = readFile(entry.path());
    return files;
  }

  TemporaryFolder folder;
};

TEST_F(WrittenFilm, ItsFilesAreTheSameFromEitherThread) {
  for (int frame = 0; frame < kFrames; ++frame) {
    writeFileAtomically(picture(frame), filmBytes(film(frame), {{"surflect.frame", std::to_string(frame)}}));
    writeFileAtomically(preview(frame), previewBytes(film(frame).color, 0.5));
  }
  const auto expected = content();
  for (const auto thread : {FilmWriter::Thread::own, FilmWriter::Thread::callers}) {
    for (const auto& [name, bytes] : expected) std::filesystem::remove(folder / name);
    FilmWriter writer(thread, {});
    for (int frame = 0; frame < kFrames; ++frame) write(writer, frame);
    EXPECT_EQ(writer.finish().size(), size_t{kFrames});
    EXPECT_TRUE(content() == expected);
  }
}

TEST_F(WrittenFilm, AFrameThatFailsIsNamedAndThoseBeforeItAreThere) {
  for (const auto thread : {FilmWriter::Thread::own, FilmWriter::Thread::callers}) {
    std::filesystem::create_directory(picture(3));
    FilmWriter writer(thread, {});
    const std::string error = errorOf([&] {
      for (int frame = 0; frame < 6; ++frame) write(writer, frame);
      writer.finish();
    });
    EXPECT_EQ(error, picture(3).string() + ": cannot write (a folder is there)");
    std::vector<std::string> names;
    for (const auto& [name, bytes] : content()) names.push_back(name);
    EXPECT_EQ(names, (std::vector<std::string>{"0.exr", "0.png", "1.exr", "1.png", "2.exr", "2.png"}));
  }
}

TEST_F(WrittenFilm, WhatIsTakenIsWrittenThoughNobodyWaitsForIt) {
  {
    FilmWriter writer(FilmWriter::Thread::own, {});
    write(writer, 0);
  }
  EXPECT_EQ(content().size(), 2u);
}

TEST_F(WrittenFilm, ACancelledFrameLeavesNothing) {
  std::atomic<bool> cancelled = false;
  Progress progress;
  progress.cancelled = [&] { return cancelled.load(); };
  for (const auto thread : {FilmWriter::Thread::own, FilmWriter::Thread::callers}) {
    cancelled = false;
    FilmWriter writer(thread, progress);
    write(writer, 0);
    cancelled = true;
    EXPECT_THROW(
        {
          write(writer, 1);
          writer.finish();
        },
        Cancelled);
    EXPECT_FALSE(content().contains("1.exr") || content().contains("1.png"));
    for (const auto& [name, bytes] : content()) EXPECT_FALSE(name.ends_with(".tmp")) << name;
  }
}

} // namespace
} // namespace surflect
