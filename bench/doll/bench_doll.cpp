// Measures one frame of a doll-scale model: every stage against this machine's limits, and all of them
// against the paper's pipeline on one thread. The model is made on the first run and kept.
#include "bench/doll/doll_model.h"
#include "bench/doll/frame_times.h"
#include "bench/doll/look_up_orders.h"
#include "bench/doll/machine.h"
#include "bench/doll/paper_frame.h"
#include "render/film.h"
#include "render/measure.h"
#include "surfel/error.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <cstdio>

namespace surflect {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kLeastDb = 100; // of the frame against the paper's
constexpr size_t kCacheBytes = size_t{4} << 30;

struct Arguments {
  DollSize size;
  fs::path model, picture;
  int frames = 7;
  int width = 1024, height = 768;
  size_t lights = 5;
  bool orders = false, json = false;
};

void parseSize(const char* option, const std::string& text, int& width, int& height) {
  char end = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &end) != 2 || std::min(width, height) < 8 ||
      std::max(width, height) > 16384)
    throw Error::mismatch("two sides of 8 to 16384 pixels, as in 1032x1360", "'" + text + "'").at(option);
}

// How near the frame comes to the paper's, both over the latter's white.
struct Check {
  double psnrDb = 0, largest = 0;
  bool passed() const { return psnrDb >= kLeastDb; }
};

Check check(const Image& paper, const Image& frame) {
  const double white = whiteOf(paper);
  if (!(white > 0)) throw Error("the frame shows nothing");
  Check check;
  check.psnrDb = compare(paper, frame, 1 / white).psnrLinear();
  for (size_t i = 0; i < paper.values.size(); ++i)
    check.largest = std::max(check.largest, std::abs(double{paper.values[i]} - frame.values[i]) / white);
  return check;
}

Json jsonOf(const MachineLimits& limits) {
  const auto pair = [](const MachineLimits::OneAll& of) { return Json{{"one", of.one}, {"all", of.all}}; };
  const auto maybe = [&](const auto& of) { return of ? pair(*of) : Json(); };
  return {{"threads", limits.threads},
          {"read_bytes_per_second", pair(limits.read)},
          {"copy_bytes_per_second", pair(limits.copy)},
          {"triad_bytes_per_second", pair(limits.triad)},
          {"random_lines_per_second", pair(limits.randomLines)},
          {"sse_flops", pair(limits.sse)},
          {"avx2_flops", maybe(limits.avx2)},
          {"avx512_flops", maybe(limits.avx512)},
          {"bf16_flops", maybe(limits.bf16)},
          {"cached_read_bytes_per_second", pair(limits.cachedRead)},
          {"direct_read_bytes_per_second", limits.directRead ? Json(*limits.directRead) : Json("refused")}};
}

Json jsonOf(const FrameCounts& counts) {
  return {{"surfels", counts.surfels},
          {"drawn", counts.drawn},
          {"visible", counts.visible},
          {"pixels", counts.pixels},
          {"contributions", counts.contributions},
          {"views", counts.views},
          {"rig_lights", counts.rigLights},
          {"lights", counts.lights},
          {"pairs", counts.pairs},
          {"lookups", counts.lookups},
          {"blocks", counts.blocks},
          {"block_bytes", counts.blockBytes},
          {"rank", counts.rank}};
}

Json jsonOf(const OrderCost& cost) {
  return {{"order", cost.order},
          {"images", cost.images},
          {"operations", cost.operations},
          {"us", 1e6 * cost.seconds},
          {"reads", cost.reads}};
}

Json ordersOf(const Model& model, const Shot& shot) {
  Json orders = Json::array();
  for (const OrderCost& cost : costOfOrders(model, shot, std::array<size_t, 3>{1, 3, 16}))
    orders.push_back(jsonOf(cost));
  return orders;
}

Json measure(const Arguments& arguments) {
  const fs::path folder =
      arguments.model.empty() ? fs::path(SURFLECT_BENCH_FOLDER) / nameOf(arguments.size) : arguments.model;
  if (!fs::exists(folder / "manifest.json")) {
    std::fprintf(stderr, "bench_doll: writing %s\n", folder.c_str());
    writeDollModel(folder, arguments.size);
  }
  const Model model = openModel(folder);
  const Shot shot = dollShot(model, arguments.width, arguments.height, arguments.lights);
  Check checked;
  PaperFrame naive;
  Lap naiveLap;
  {
    BlockCache cache(model.files, kCacheBytes);
    FrameStats ignored;
    const Image frame =
        renderFrame(model, *shot.warp, shot.camera, shot.lights, shot.options, cache, ignored).color;
    ResidentBlocks blocks(cache);
    const auto paper = [&] {
      return paperFrame(model, *shot.warp, shot.camera, shot.lights, shot.options, blocks);
    };
    checked = check(paper().color, frame);
    if (!arguments.picture.empty()) writePreview(arguments.picture, frame, 1 / whiteOf(frame));
    naiveLap = lapOf([&] { naive = paper(); }); // all of whose blocks are now in memory
  }
  BlockCache cache(model.files, kCacheBytes);
  const FrameTimes times = timeFrames(model, shot, cache, kCacheBytes, arguments.frames);

  double naiveMs = 0;
  Json naiveStages;
  for (const auto& [stage, seconds] : naive.seconds) {
    naiveMs += 1e3 * seconds;
    naiveStages[stage] = 1e3 * seconds;
  }
  const MachineLimits limits = measureMachine(folder);

  double boundMs = 0;
  Json stages = Json::array();
  for (const StageWork& work : workOf(times.counts)) {
    const Times& ofStage = times.stages.find(work.stage)->second;
    const double bound = 1e3 * boundSeconds(work, limits);
    boundMs += bound;
    stages.push_back({{"stage", work.stage},
                      {"ms", 1e3 * ofStage.median},
                      {"best_ms", 1e3 * ofStage.best},
                      {"cpu_ms", 1e3 * ofStage.processor},
                      {"bytes", work.bytes},
                      {"operations", work.operations},
                      {"bound_ms", bound},
                      {"bound_by", isBoundByMemory(work, limits) ? "memory" : "arithmetic"},
                      {"over_bound", 1e3 * ofStage.median / bound},
                      {"cpu_over_bound", 1e3 * ofStage.processor / limits.threads / bound}});
  }
  const double frameMs = 1e3 * times.frame.median;
  const Json orders = arguments.orders ? ordersOf(model, shot) : Json();
  return {{"model", folder.string()},
          {"output", {arguments.width, arguments.height}},
          {"machine", jsonOf(limits)},
          {"check",
           {{"psnr_linear_db", std::min(checked.psnrDb, 999.0)},
            {"largest_difference", checked.largest},
            {"passed", checked.passed()}}},
          {"counts", jsonOf(times.counts)},
          {"stages", stages},
          {"frame_ms", frameMs},
          {"frame_best_ms", 1e3 * times.frame.best},
          {"frame_cpu_ms", 1e3 * times.frame.processor},
          {"first_frame_ms", 1e3 * times.firstSeconds},
          {"cold_frame_ms", 1e3 * times.coldSeconds},
          {"cold_bytes_per_second", static_cast<double>(times.counts.blockBytes) / times.coldSeconds},
          {"bound_ms", boundMs},
          {"frame_over_bound", frameMs / boundMs},
          {"frame_cpu_over_bound", 1e3 * times.frame.processor / limits.threads / boundMs},
          {"naive_ms", naiveMs},
          {"naive_cpu_ms", 1e3 * naiveLap.processorSeconds},
          {"naive_stages_ms", naiveStages},
          {"naive_lookups", naive.lookups},
          {"naive_over_frame", naiveMs / frameMs},
          {"look_up_orders", orders},
          {"naive_cpu_over_frame", naiveLap.processorSeconds * limits.threads / times.frame.processor}};
}

void print(const Json& report) {
  const auto number = [](const Json& value) { return value.get<double>(); };
  const Json& machine = report["machine"];
  fmt::print("{}\n{} threads", report["model"].get<std::string>(), machine["threads"].get<int>());
  for (const auto& [name, unit] : {std::pair{"read", "_bytes_per_second"},
                                   {"copy", "_bytes_per_second"},
                                   {"triad", "_bytes_per_second"},
                                   {"cached_read", "_bytes_per_second"},
                                   {"random_lines", "_per_second"},
                                   {"sse", "_flops"},
                                   {"avx2", "_flops"},
                                   {"avx512", "_flops"},
                                   {"bf16", "_flops"}}) {
    const Json& limit = machine[std::string(name) + unit];
    if (!limit.is_null())
      fmt::print("; {} {:.3g} {:.3g} G", name, number(limit["one"]) / 1e9, number(limit["all"]) / 1e9);
  }
  const Json& direct = machine["direct_read_bytes_per_second"];
  if (direct.is_number())
    fmt::print("; direct read {:.3g} G\n", number(direct) / 1e9);
  else
    fmt::print("; direct read: the file system refuses\n");
  const Json& counts = report["counts"];
  fmt::print(
      "{} surfels, {} visible, {} pairs, {} look-ups, {:.1f} MB of blocks of rank {:.1f}, {} contributions\n",
      counts["surfels"].dump(), counts["visible"].dump(), counts["pairs"].dump(), counts["lookups"].dump(),
      number(counts["block_bytes"]) / 1e6, number(counts["rank"]), counts["contributions"].dump());
  fmt::print("{:.1f} dB against the paper's pipeline, largest difference {:.2g} of white\n\n",
             number(report["check"]["psnr_linear_db"]), number(report["check"]["largest_difference"]));
  fmt::print("| stage | ms | best ms | cpu ms | MB | Mop | bound ms | by | over bound | cpu over bound |\n"
             "|---|---|---|---|---|---|---|---|---|---|\n");
  for (const Json& stage : report["stages"])
    fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} | {:.1f} | {:.0f} | {:.2f} | {} | {:.1f} | {:.1f} |\n",
               stage["stage"].get<std::string>(), number(stage["ms"]), number(stage["best_ms"]),
               number(stage["cpu_ms"]), number(stage["bytes"]) / 1e6, number(stage["operations"]) / 1e6,
               number(stage["bound_ms"]), stage["bound_by"].get<std::string>(), number(stage["over_bound"]),
               number(stage["cpu_over_bound"]));
  fmt::print("| frame | {:.2f} | {:.2f} | {:.2f} | | | {:.2f} | | {:.1f} | {:.1f} |\n",
             number(report["frame_ms"]), number(report["frame_best_ms"]), number(report["frame_cpu_ms"]),
             number(report["bound_ms"]), number(report["frame_over_bound"]),
             number(report["frame_cpu_over_bound"]));
  fmt::print("\nfirst frame {:.1f} ms; cold, from the disk, {:.1f} ms, {:.0f} MB/s of blocks\n",
             number(report["first_frame_ms"]), number(report["cold_frame_ms"]),
             number(report["cold_bytes_per_second"]) / 1e6);
  fmt::print("the paper's pipeline on one thread {:.0f} ms, {:.0f} ms of the processor: {:.1f} frames, "
             "{:.1f} by it\n",
             number(report["naive_ms"]), number(report["naive_cpu_ms"]), number(report["naive_over_frame"]),
             number(report["naive_cpu_over_frame"]));
  if (report["look_up_orders"].is_null()) return;
  fmt::print(
      "\n| images in the cache | order of the look-ups | us each | blocks read each |\n|---|---|---|---|\n");
  for (const Json& cost : report["look_up_orders"])
    fmt::print("| {} | {} | {:.2f} | {:.3f} |\n", cost["images"].dump(), cost["order"].get<std::string>(),
               number(cost["us"]), number(cost["reads"]));
}

} // namespace
} // namespace surflect

int main(int argc, char** argv) {
  using namespace surflect;
  Arguments arguments;
  CLI::App app("Measures a frame at the scale of the paper's doll.\n"
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
  app.add_option("--frames", arguments.frames, "that are timed")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--picture", arguments.picture, "a PNG of the frame");
  app.add_flag("--orders", arguments.orders, "also look-ups in several orders, from the disk");
  app.add_flag("--json", arguments.json, "one object instead of a table");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    parseSize("--size", size, arguments.size.width, arguments.size.height);
    parseSize("--output", output, arguments.width, arguments.height);
    const Json report = measure(arguments);
    if (arguments.json)
      fmt::print("{}\n", report.dump(2));
    else
      print(report);
    if (report["check"]["passed"] == true) return 0;
    std::fprintf(stderr, "bench_doll: the frame is not that of the paper's pipeline\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_doll: %s\n", error.what());
  }
  return 1;
}
