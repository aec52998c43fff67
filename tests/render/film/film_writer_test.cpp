#include "render/film/film_writer.h"

#include "surfel/base/error.h"
#include "tests/srf/image/files.h"

#include <unistd.h>

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

namespace surflect::film {
namespace {

constexpr int kFrames = 12; // more than share a commit
const DisplayOptions kShown{.white = 2, .isTransparent = true};

class WrittenFilm : public ::testing::Test {
protected:
  static method::FrameLayers film(int frame) {
    const auto seed = static_cast<unsigned>(frame);
    return {image::randomImage(40, 30, 4, 0, 1, seed),
            {{"stretch", image::randomImage(40, 30, 1, 1, 2, seed)}}};
  }
  std::filesystem::path picture(int frame) const { return folder / (std::to_string(frame) + ".exr"); }
  std::filesystem::path preview(int frame) const { return folder / (std::to_string(frame) + ".png"); }
  void write(FilmWriter& writer, int frame) const {
    writer.write({picture(frame), {{"surflect.frame", std::to_string(frame)}}, preview(frame), kShown},
                 film(frame));
  }
  std::map<std::string, std::string> content() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
      if (entry.is_regular_file()) files[entry.path().filename().string()] = readFile(entry.path());
    return files;
  }

  std::vector<std::string> names() const { // temporaries are left out
    std::vector<std::string> finished;
    for (const auto& [name, bytes] : content())
      if (!name.ends_with(".tmp")) finished.push_back(name);
    return finished;
  }

  image::TemporaryFolder folder;
};

// A film whose caller is always ahead of the writing thread, so that frames share commits.
class SharedCommit : public WrittenFilm {
protected:
  // Calls during(frame) once for each frame: it is being encoded, and the caller waits to hand over the next
  // one or to finish.
  void writeFrames(int count, const std::function<void(int frame)>& during) const {
    std::atomic<int> handedOver = 0;
    std::mutex mutex;
    int seen = 0; // frames
    Progress progress;
    progress.cancelled = [&, caller = ::gettid()] {
      while (!sleeps(caller)) std::this_thread::yield();
      const std::lock_guard lock(mutex);
      if (std::exchange(seen, handedOver) < handedOver) during(handedOver - 1);
      return false;
    };
    FilmWriter writer(FilmWriter::Thread::own, progress);
    for (int frame = 0; frame < count; ++frame) {
      write(writer, frame);
      ++handedOver;
    }
    writer.finish();
  }

private:
  static bool sleeps(pid_t thread) {
    const std::string status = readFile("/proc/self/task/" + std::to_string(thread) + "/stat");
    return status.at(status.rfind(')') + 2) == 'S';
  }
};

TEST_F(SharedCommit, TakesUpToEightFrames) {
  std::vector<size_t> finished;
  writeFrames(kFrames, [&](int) { finished.push_back(names().size()); });
  EXPECT_EQ(finished, (std::vector<size_t>{0, 0, 0, 0, 0, 0, 0, 0, 16, 16, 16, 16}));
  EXPECT_EQ(names().size(), size_t{2 * kFrames});
}

TEST_F(SharedCommit, HasNothingOfAFrameThatFailsAndAllOfThoseBeforeIt) {
  std::filesystem::create_directory(picture(2));
  EXPECT_EQ(image::errorOf([&] { writeFrames(4, [](int) {}); }),
            picture(2).string() + ": cannot write (a folder is there)");
  const auto left = content();
  EXPECT_EQ(left.size(), 4u);
  for (const int frame : {0, 1}) {
    EXPECT_EQ(left.at(std::to_string(frame) + ".exr"),
              frameBytes(film(frame), {{"surflect.frame", std::to_string(frame)}}));
    EXPECT_EQ(left.at(std::to_string(frame) + ".png"), pngBytes(shownColor(film(frame).color, kShown)));
  }
}

// `render --resume` takes a picture that is there for a sign that its preview is there, too.
TEST_F(SharedCommit, ThatStopsInBetweenHasNoPictureWithoutItsPreview) {
  const auto blockFrame2 = [&](int frame) { // once it is encoded
    if (frame == 3) std::filesystem::create_directory(picture(2));
  };
  const std::string error = image::errorOf([&] { writeFrames(4, blockFrame2); });
  EXPECT_EQ(error.find(picture(2).string() + ": cannot rename to"), 0u) << error;
  EXPECT_EQ(names(), (std::vector<std::string>{"0.exr", "0.png", "1.exr", "1.png", "2.png"}));
  EXPECT_EQ(content().size(), names().size()); // no temporaries
}

TEST_F(WrittenFilm, ItsFilesAreTheSameFromEitherThread) {
  for (int frame = 0; frame < kFrames; ++frame) {
    writeFileAtomically(picture(frame), frameBytes(film(frame), {{"surflect.frame", std::to_string(frame)}}));
    writeFileAtomically(preview(frame), pngBytes(shownColor(film(frame).color, kShown)));
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
    const std::string error = image::errorOf([&] {
      for (int frame = 0; frame < 6; ++frame) write(writer, frame);
      writer.finish();
    });
    EXPECT_EQ(error, picture(3).string() + ": cannot write (a folder is there)");
    EXPECT_EQ(names(), (std::vector<std::string>{"0.exr", "0.png", "1.exr", "1.png", "2.exr", "2.png"}));
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
} // namespace surflect::film
