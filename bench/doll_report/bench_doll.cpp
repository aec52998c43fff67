// Measures one frame of a doll-scale model, every stage against this machine's limits and all of them against
// the paper's pipeline on one thread; how its cost grows with surfels, views, lights and pixels; and beside
// it what frames and models are made by: splats, warps, look-ups in several orders, the packing of blocks,
// how fast and, of a doll from the light stage, how good it is. The model is made on the first run and kept.
#include "bench/doll/doll_model.h"
#include "bench/doll_report/doll_report.h"
#include "bench/quality/traced_blocks.h"
#include "render/evaluation/measure.h"
#include "render/film/frame_file.h"
#include "surfel/base/error.h"

#include <CLI/CLI.hpp>

#include <array>
#include <cmath>
#include <cstdio>

namespace surflect::bench {
namespace {

namespace fs = std::filesystem;

constexpr size_t kCacheBytes = size_t{4} << 30;

struct Arguments {
  DollSize size;
  fs::path model, picture;
  int frames = 7;
  int width = 1024, height = 768;
  size_t lights = 5;
  size_t cacheMb = 64;
  std::string stageScale = "paper";
  bool json = false;
};

void parseSize(const char* option, const std::string& text, int& width, int& height) {
  char end = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &end) != 2 || std::min(width, height) < 8 ||
      std::max(width, height) > 16384)
    throw Error::mismatch("two sides of 8 to 16384 pixels, as in 1032x1360", "'" + text + "'").at(option);
}

FrameCheck check(const image::Image& paper, const image::Image& frame) {
  const double white = film::whiteOf(paper);
  if (!(white > 0)) throw Error("the frame shows nothing");
  FrameCheck check;
  check.psnrDb = evaluation::compare(paper, frame, 1 / white).psnrLinear();
  for (size_t i = 0; i < paper.values.size(); ++i)
    check.largest = std::max(check.largest, std::abs(double{paper.values[i]} - frame.values[i]) / white);
  return check;
}

// The frame as the paper's pipeline makes it, and how far ours is from it.
void measurePaper(const model::Model& model, const Shot& shot, const fs::path& picture,
                  DollMeasurements& measured) {
  codec::BlockCache cache(model.files, kCacheBytes);
  surfels::FrameStats ignored;
  const image::Image frame =
      surfels::renderFrame(model, *shot.warp, shot.camera, shot.lights, shot.options, cache, ignored).color;
  ResidentBlocks blocks(cache);
  const auto paper = [&] {
    return paperFrame(model, *shot.warp, shot.camera, shot.lights, shot.options, blocks);
  };
  measured.check = check(paper().color, frame);
  if (!picture.empty()) film::writePreview(picture, frame, 1 / film::whiteOf(frame));
  measured.paperLap = lapOf([&] { measured.paper = paper(); }); // all of whose blocks are now in memory
}

StageDoll packStageDoll(const std::string& scale, const Progress& progress) {
  const stage::Stage stage = stage::readStage(fs::path(SURFLECT_STAGES_FOLDER) / "doll.toml", scale);
  const BlockSample sample;
  const auto blocks = traceBlocks(stage, sample, progress);
  return {scale, blocks.size(), stage.rig.trainingViews, sample.every,
          qualityAt(StageDoll::kBytes, blocks, progress)};
}

// Says what is done now, each thing once.
Progress told() {
  Progress progress;
  progress.report = [last = std::string()](std::string_view stage, double) mutable {
    if (last == stage) return;
    last = stage;
    std::fprintf(stderr, "bench_doll: %s\n", last.c_str());
  };
  return progress;
}

DollMeasurements measure(const Arguments& arguments) {
  DollMeasurements measured;
  measured.model =
      arguments.model.empty() ? fs::path(SURFLECT_BENCH_FOLDER) / nameOf(arguments.size) : arguments.model;
  measured.width = arguments.width;
  measured.height = arguments.height;
  if (!fs::exists(measured.model / "manifest.json")) {
    std::fprintf(stderr, "bench_doll: writing %s\n", measured.model.c_str());
    writeDollModel(measured.model, arguments.size);
  }
  const model::Model model = model::openModel(measured.model);
  const Shot shot = dollShot(model, arguments.width, arguments.height, arguments.lights);
  measured.bounded = boundedFrames(model, shot, arguments.cacheMb << 20);
  measurePaper(model, shot, arguments.picture, measured);
  {
    codec::BlockCache cache(model.files, kCacheBytes);
    measured.frame = timeFrames(model, shot, cache, kCacheBytes, arguments.frames);
  }
  measured.machine = measureMachine(measured.model);
  measured.orders = costOfOrders(model, shot, std::array<size_t, 3>{1, 3, 16});
  measured.packing = timePacking(arguments.frames);
  measured.splats = timeSplats(arguments.frames);
  measured.warps = timeWarps(arguments.frames);
  const Progress progress = told();
  measured.growth = measureGrowth(model, arguments.width, arguments.height, arguments.frames, progress);
  measured.stageDoll = packStageDoll(arguments.stageScale, progress);
  return measured;
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  using namespace surflect;
  Arguments arguments;
  CLI::App app(
      "Measures a frame at the scale of the paper's doll, how its cost grows, and what it is made by.\n"
      "Example: bench_doll --json > doll.json");
  std::string size = "1032x1360", output = "1024x768";
  app.add_option("--model", arguments.model,
                 "a model, made here if there is none; default: kept beside the build");
  const auto counted = CLI::Range(size_t{1}, size_t{100'000'000});
  app.add_option("--surfels", arguments.size.surfels, "of the model that is made")
      ->capture_default_str()
      ->check(counted);
  app.add_option("--views", arguments.size.views, "of it")->capture_default_str()->check(CLI::Range(1, 9999));
  app.add_option("--lights", arguments.size.lights, "of it")
      ->capture_default_str()
      ->check(CLI::Range(1, 9999));
  app.add_option("--size", size, "of its pictures")->capture_default_str();
  app.add_option("--output", output, "size of the frame")->capture_default_str();
  app.add_option("--shot-lights", arguments.lights, "of the frame")
      ->capture_default_str()
      ->check(CLI::Range(1, 9999));
  app.add_option("--frames", arguments.frames, "that are timed, and rounds of all else")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--picture", arguments.picture, "a PNG of the frame");
  app.add_option("--cache-mb", arguments.cacheMb, "of the frames whose memory is measured")
      ->capture_default_str()
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--stage-scale", arguments.stageScale,
                 "of the light stage's doll, some blocks of which are packed")
      ->capture_default_str()
      ->check(CLI::IsMember({"paper", "small", "tiny"}));
  app.add_flag("--json", arguments.json, "one object instead of a table");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    parseSize("--size", size, arguments.size.width, arguments.size.height);
    parseSize("--output", output, arguments.width, arguments.height);
    const DollMeasurements measured = measure(arguments);
    const std::string report = arguments.json ? jsonReport(measured) : textReport(measured);
    std::fputs(report.c_str(), stdout);
    if (measured.check.passed()) return 0;
    std::fprintf(stderr, "bench_doll: the frame is not that of the paper's pipeline\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_doll: %s\n", error.what());
  }
  return 1;
}
