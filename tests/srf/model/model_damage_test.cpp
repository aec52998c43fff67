// Every truncation and every flipped bit of a packed model is either rejected or harmless.

#include "srf/shading/shade.h"
#include "surfel/base/file.h"
#include "tests/support/synthetic_capture.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <mutex>

namespace surflect::model {
namespace {

using studio::PackedStudio;
using studio::Studio;

// The smallest possible model, since every bit of it is flipped.
Studio tinyStudio() {
  Studio tiny;
  tiny.cameras = 2;
  tiny.lights = 2;
  tiny.size = 18;
  return tiny;
}

// Content of a model as a reader sees it: every block, and the radiance of every surfel from its front under
// two lights.
struct Seen {
  std::vector<codec::CacheAlignedBytes> blocks;
  std::vector<Rgb> radiance;
  std::vector<float> radii;

  friend bool operator==(const Seen&, const Seen&) = default;
};

Seen look(const std::filesystem::path& folder) {
  const Model model = openModel(folder);
  Seen seen;
  for (const codec::ViewFile& file : model.files)
    for (uint32_t number = 0; number < file.blockCount(); ++number) {
      codec::Block block = file.read(number);
      seen.blocks.push_back(std::move(block.values));
    }
  weights::QueryBatch batch;
  batch.lights = 2;
  for (uint32_t surfel = 0; surfel < model.cloud.size(); ++surfel) {
    const auto front = assume<Direction3<AcquisitionSpace>>(rotationOf<float>(model.cloud.r0[surfel]).col(2));
    batch.surfels.push_back(surfel);
    batch.towardsView.push_back(front);
    for (const Vec3<float>& towards : {Vec3<float>(0, 0, 1), Vec3<float>(0, 1, 0)}) {
      batch.towardsLight.push_back(assume<Direction3<AcquisitionSpace>>(towards));
      batch.irradiance.push_back({1, 1, 1});
    }
  }
  codec::BlockCache cache(model.files, 1 << 20);
  shading::ShadingStats stats;
  seen.radiance = shading::shade(model, batch, {}, cache, stats).radiance;
  seen.radii = model.cloud.radius;
  for (size_t i = 0; i < model.cloud.size(); ++i)
    for (const float number : {model.cloud.coverage[i], model.cloud.p0[i].x(), model.cloud.p0[i].y(),
                               model.cloud.p0[i].z(), model.cloud.r0[i].x, model.cloud.r0[i].y})
      seen.radii.push_back(number);
  return seen;
}

enum class Outcome { refused, harmless, seenWrong };

Outcome outcomeOf(const std::filesystem::path& folder, const Seen& whole) {
  try {
    return look(folder) == whole ? Outcome::harmless : Outcome::seenWrong;
  } catch (const Error&) { // any other exception fails the test
    return Outcome::refused;
  }
}

// Runs damage(bytes of the file, case) for all cases, with a folder for each thread.
struct Tally {
  std::atomic<size_t> refused = 0, harmless = 0;
  std::mutex mutex;
  std::vector<std::string> wrong;
};

template <class Damage>
void tryAll(const PackedStudio& packed, const Seen& whole, const std::string& name, size_t cases,
            const Damage& damage, Tally& tally) {
  constexpr size_t perTask = 512;
  const std::string content = readFile(packed.model.folder / name);
  tbb::parallel_for(size_t{0}, (cases + perTask - 1) / perTask, [&](size_t task) {
    const image::TemporaryFolder copy;
    std::filesystem::copy(packed.model.folder, copy / "m", std::filesystem::copy_options::recursive);
    for (size_t i = task * perTask; i < std::min(cases, (task + 1) * perTask); ++i) {
      image::writeBytes(copy / ("m/" + name), damage(content, i));
      const Outcome outcome = outcomeOf(copy / "m", whole);
      if (outcome == Outcome::refused) ++tally.refused;
      if (outcome == Outcome::harmless) ++tally.harmless;
      if (outcome != Outcome::seenWrong) continue;
      const std::lock_guard lock(tally.mutex);
      tally.wrong.push_back(name + " case " + std::to_string(i));
    }
  });
}

const std::vector<std::string> files = {"manifest.json",   "transforms.json", "surfels.ply",
                                        "levels.bin",      "fades.bin",       "shadows.bin",
                                        "views/0000.srfb", "views/0001.srfb"};

TEST(ModelDamage, EveryTruncationIsRefusedOrHarmless) {
  const PackedStudio packed(tinyStudio(), 12);
  const Seen whole = look(packed.model.folder);
  Tally tally;
  size_t cases = 0;
  for (const std::string& name : files) {
    const size_t bytes = std::filesystem::file_size(packed.model.folder / name);
    tryAll(
        packed, whole, name, bytes,
        [](const std::string& content, size_t length) { return content.substr(0, length); }, tally);
    cases += bytes;
  }
  EXPECT_EQ(tally.wrong, std::vector<std::string>{});
  EXPECT_EQ(tally.harmless, 1u); // the manifest is complete without its final line feed
  EXPECT_EQ(tally.refused, cases - 1);
}

TEST(ModelDamage, EveryFlippedBitIsRefusedOrHarmless) {
  const PackedStudio packed(tinyStudio(), 12);
  const Seen whole = look(packed.model.folder);
  for (const std::string& name : files) {
    const size_t bits = 8 * std::filesystem::file_size(packed.model.folder / name);
    Tally tally;
    tryAll(
        packed, whole, name, bits,
        [](std::string content, size_t bit) {
          content[bit / 8] = static_cast<char>(content[bit / 8] ^ 1 << bit % 8);
          return content;
        },
        tally);
    EXPECT_EQ(tally.wrong, std::vector<std::string>{});
    EXPECT_EQ(tally.refused + tally.harmless, bits);
    // Only the manifest contains insignificant bytes: white space that may be other white space.
    if (name != "manifest.json") {
      EXPECT_EQ(tally.harmless, 0u) << name;
    }
  }
}

// A capture has no checksum: a flipped digit gives another capture. Every damaged file must still be read or
// rejected.
TEST(CaptureDamage, EveryFlippedBitIsACaptureOrAnError) {
  const image::TemporaryFolder folder;
  const capture::Capture capture = photograph(tinyStudio(), folder / "capture");
  const std::string content = readFile(capture.file);
  size_t refused = 0;
  for (size_t bit = 0; bit < 8 * content.size(); ++bit) {
    std::string damaged = content;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ 1 << bit % 8);
    try {
      const capture::Capture read = capture::parseCapture(damaged, capture.file);
      for (const capture::Frame& frame : read.frames) ASSERT_LT(frame.view, read.views.size());
    } catch (const Error& error) {
      ++refused;
      ASSERT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_GT(refused, 4 * content.size()); // most bits break the syntax
}

} // namespace
} // namespace surflect::model
