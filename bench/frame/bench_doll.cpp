// Times a frame of a model as large as the paper's doll: by stages, compared with the reference frame and
// with the machine's limits; with a cold cache; and with growing numbers of surfels, views, lights and
// pixels. The frame is checked against the reference before timing. The model is generated on the first run
// and kept.
#include "bench/doll/doll_model.h"
#include "bench/frame/frame_benchmark.h"
#include "bench/frame/machine.h"
#include "render/evaluation/measure.h"
#include "render/film/frame_file.h"
#include "surfel/base/error.h"
#include "surfel/math/median.h"

#include <CLI/CLI.hpp>
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <iostream>
#include <map>
#include <thread>

namespace surflect::bench {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Arguments {
  DollSize size;
  fs::path model;
  int frames = 7;
  int width = 1024, height = 768;
  size_t lights = 5;
  bool growth = true, json = false;
};

constexpr double kLeastDb = 100; // least PSNR of the frame against the reference frame

bool isMedian(const benchmark::BenchmarkReporter::Run& run) {
  return run.aggregate_name == "median" || run.repetitions == 1;
}

// Records medians of times and the largest values of counters by benchmark name.
class Recorder : public benchmark::BenchmarkReporter {
public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      const std::string& name = run.run_name.function_name;
      if (isMedian(run)) medians_[name] = run;
      for (const auto& [counter, value] : run.counters)
        largest_[name][counter] = std::max(largest_[name][counter], value.value);
    }
  }
  double ms(const std::string& name) const { return medians_.at(name).GetAdjustedRealTime(); }
  double cpuMs(const std::string& name) const { return medians_.at(name).GetAdjustedCPUTime(); }
  double largest(const std::string& name, const char* counter) const { return largest_.at(name).at(counter); }

private:
  std::map<std::string, Run> medians_;
  std::map<std::string, std::map<std::string, double>> largest_;
};

// Prints Google Benchmark's table with medians only.
class MedianReporter : public benchmark::ConsoleReporter {
public:
  MedianReporter() : ConsoleReporter(OO_Tabular) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    std::vector<Run> medians;
    std::ranges::copy_if(runs, std::back_inserter(medians), isMedian);
    ConsoleReporter::ReportRuns(medians);
  }
};

benchmark::internal::Benchmark* timed(const std::string& name, int repetitions,
                                      const std::function<void(benchmark::State&)>& run) {
  return benchmark::RegisterBenchmark(name.c_str(), run)
      ->Iterations(1)
      ->Repetitions(repetitions)
      ->Unit(benchmark::kMillisecond)
      ->MeasureProcessCPUTime()
      ->UseRealTime();
}

void registerFrame(FrameBenchmark& entry, int frames) {
  timed(entry.name, frames, [&entry](benchmark::State& state) {
    if (!entry.frame) entry.frame = entry.make();
    for (auto _ : state) entry.frame->render();
    entry.stats.push_back(entry.frame->last());
    for (const auto& [stage, seconds] : entry.stats.back().seconds) state.counters[stage] = 1e3 * seconds;
  });
}

Json stagesOf(const FrameBenchmark& entry) {
  Json stages = Json::array();
  for (const std::string_view stage : kStages) {
    std::vector<double> ms, cpuMs;
    for (const surfels::FrameStats& stats : entry.stats) {
      ms.push_back(1e3 * stats.seconds.at(std::string(stage)));
      cpuMs.push_back(1e3 * stats.processorSeconds.at(std::string(stage)));
    }
    stages.push_back({{"stage", stage}, {"ms", median(ms)}, {"cpu_ms", median(cpuMs)}});
  }
  return stages;
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

// The timed frames, and the report.
class Bench {
public:
  explicit Bench(const Arguments& arguments) : arguments_(arguments) {
    folder_ =
        arguments.model.empty() ? fs::path(SURFLECT_BENCH_FOLDER) / nameOf(arguments.size) : arguments.model;
    if (!fs::exists(folder_ / "manifest.json")) {
      std::fprintf(stderr, "bench_doll: writing %s\n", folder_.c_str());
      writeDollModel(folder_, arguments.size);
    }
    const auto model = std::make_shared<const model::Model>(model::openModel(folder_));
    const auto make = [=, this] {
      return std::make_unique<WarmFrame>(
          model, dollShot(model->cloud, arguments_.width, arguments_.height, arguments_.lights));
    };
    frames_.push_back({"frame", "", 0, make});
    frames_.push_back({"preview", "", 0, [=, this] {
                         return std::make_unique<WarmFrame>(
                             model, previewOf(dollShot(model->cloud, arguments_.width, arguments_.height,
                                                       arguments_.lights)));
                       }});
    for (FrameBenchmark& entry : frames_) entry.frame = entry.make();
    if (arguments.growth)
      for (FrameBenchmark& entry :
           growthBenchmarks(model, arguments.width, arguments.height, arguments.lights))
        frames_.push_back(std::move(entry));
    checkFrame();
    registerAll();
  }

  Json report(const Recorder& recorder) {
    const FrameCounts counts = countsOf(*frames_[0].frame);
    const MachineLimits limits{static_cast<int>(std::thread::hardware_concurrency()),
                               std::max(recorder.largest("machine/read", "bytes_per_second"),
                                        recorder.largest("machine/triad", "bytes_per_second")),
                               recorder.largest("machine/multiply-add", "flops")};
    const std::vector<StageWork> works = workOf(counts);
    Json stages = stagesOf(frames_[0]);
    double boundMs = 0;
    for (size_t i = 0; i < works.size(); ++i) {
      Json& stage = stages[i];
      const double bound = 1e3 * boundSeconds(works[i], limits);
      boundMs += bound;
      stage["naive_ms"] = 1e3 * reference_.seconds.at(std::string(works[i].stage));
      stage["bytes"] = works[i].bytes;
      stage["operations"] = works[i].operations;
      stage["bound_ms"] = bound;
      stage["bound_by"] = isBoundByMemory(works[i], limits) ? "memory" : "arithmetic";
      stage["over_bound"] = stage["ms"].get<double>() / bound;
    }
    const double frameMs = recorder.ms("frame"), naiveMs = recorder.ms("reference frame"),
                 coldMs = recorder.ms("cold frame"), previewMs = recorder.ms("preview");
    return {{"model", folder_.string()},
            {"output", {arguments_.width, arguments_.height}},
            {"machine",
             {{"threads", limits.threads},
              {"bytes_per_second", limits.bytesPerSecond},
              {"flops", limits.flopsPerSecond}}},
            {"check", {{"psnr_linear_db", psnrDb_}, {"largest_difference", largest_}}},
            {"counts", jsonOf(counts)},
            {"stages", stages},
            {"frame_ms", frameMs},
            {"frame_cpu_ms", recorder.cpuMs("frame")},
            {"bound_ms", boundMs},
            {"frame_over_bound", frameMs / boundMs},
            {"preview_ms", previewMs},
            {"preview_cpu_ms", recorder.cpuMs("preview")},
            {"preview_over_bound", previewMs / boundMs},
            {"preview_db", previewDb_},
            {"preview_stages", stagesOf(frames_[1])},
            {"naive_ms", naiveMs},
            {"naive_cpu_ms", recorder.cpuMs("reference frame")},
            {"naive_lookups", reference_.lookups},
            {"naive_over_frame", naiveMs / frameMs},
            {"cold_frame_ms", coldMs},
            {"cold_bytes_per_second", 1e3 * static_cast<double>(counts.blockBytes) / coldMs},
            {"growth", growth(recorder, counts)}};
  }

private:
  surfels::ReferenceFrame referenceOf() {
    WarmFrame& frame = *frames_[0].frame;
    const Shot& shot = frame.shot();
    return surfels::referenceFrame(frame.model(), *shot.warp, shot.camera, shot.lights, shot.options,
                                   frame.cache());
  }

  // Compares the frame with the reference frame, whose white level is 1, and the preview with the frame.
  void checkFrame() {
    WarmFrame& frame = *frames_[0].frame;
    reference_ = referenceOf();
    const image::Image &wanted = reference_.color, &got = frame.render().color;
    const double white = film::whiteOf(wanted);
    psnrDb_ = std::min(evaluation::compare(wanted, got, 1 / white).psnrLinear(), 999.0);
    previewDb_ = evaluation::compare(got, frames_[1].frame->render().color, 1 / white).psnrLinear();
    for (size_t i = 0; i < wanted.values.size(); ++i)
      largest_ = std::max(largest_, std::abs(double{wanted.values[i]} - got.values[i]) / white);
    if (!(white > 0 && psnrDb_ >= kLeastDb))
      throw Error::mismatch(fmt::format("{} dB from the reference frame or more", kLeastDb),
                            fmt::format("{:.1f} dB", psnrDb_));
  }

  void registerAll() {
    const model::Model& model = frames_[0].frame->model();
    for (FrameBenchmark& entry : frames_) registerFrame(entry, arguments_.frames);
    timed("reference frame", 1, [this](benchmark::State& state) {
      for (auto _ : state) reference_ = referenceOf();
    });
    timed("cold frame", std::min(arguments_.frames, 3), [this, &model](benchmark::State& state) {
      forgetFiles(model);
      for (auto _ : state) {
        const auto cold = frames_[0].make();
        state.counters["MB/s"] = benchmark::Counter(
            1e-6 * static_cast<double>(cold->first().shading.bytesRead), benchmark::Counter::kIsRate);
      }
    });
    registerMachine();
  }

  // Rows of each sweep, with the exponent by which processor time grows with size.
  Json growth(const Recorder& recorder, const FrameCounts& counts) const {
    std::map<std::string, std::map<double, const FrameBenchmark*>> sweeps;
    for (const FrameBenchmark& entry : frames_) sweeps[entry.what][entry.size] = &entry;
    sweeps.erase(""); // the doll's frame, which belongs to three sweeps
    sweeps["views"][static_cast<double>(counts.views)] = &frames_[0];
    sweeps["pixels"][static_cast<double>(counts.pixels)] = &frames_[0];
    sweeps["lights"][static_cast<double>(counts.lights)] = &frames_[0];
    Json report;
    for (const auto& [what, rows] : sweeps) {
      for (const auto& [size, entry] : rows)
        report[what]["rows"].push_back({{"size", size},
                                        {"frame_ms", recorder.ms(entry->name)},
                                        {"frame_cpu_ms", recorder.cpuMs(entry->name)},
                                        {"stages", stagesOf(*entry)}});
      const auto first = rows.begin(), last = std::prev(rows.end());
      if (last->first > first->first)
        report[what]["exponent"] =
            std::log(recorder.cpuMs(last->second->name) / recorder.cpuMs(first->second->name)) /
            std::log(last->first / first->first);
    }
    return report;
  }

  Arguments arguments_;
  fs::path folder_;
  // The doll's frame, then its preview, then growth; a deque, since benchmarks hold references.
  std::deque<FrameBenchmark> frames_;
  surfels::ReferenceFrame reference_;
  double psnrDb_ = 0, largest_ = 0, previewDb_ = 0;
};

void parseSize(const char* option, const std::string& text, int& width, int& height) {
  char end = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &end) != 2 || std::min(width, height) < 8 ||
      std::max(width, height) > 16384)
    throw Error::mismatch("two sides of 8 to 16384 pixels, as in 1032x1360", "'" + text + "'").at(option);
}

int run(const Arguments& arguments, std::vector<std::string> flags) {
  flags.insert(flags.begin(), {"bench_doll", "--benchmark_enable_random_interleaving=true"});
  std::vector<char*> pointers;
  for (std::string& flag : flags) pointers.push_back(flag.data());
  auto count = static_cast<int>(pointers.size());
  benchmark::Initialize(&count, pointers.data());
  if (benchmark::ReportUnrecognizedArguments(count, pointers.data())) return 2;
  Bench bench(arguments);
  if (arguments.json) {
    Recorder recorder;
    benchmark::RunSpecifiedBenchmarks(&recorder);
    std::cout << bench.report(recorder).dump(2) << "\n";
  } else {
    MedianReporter reporter;
    benchmark::RunSpecifiedBenchmarks(&reporter);
  }
  return 0;
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  using namespace surflect;
  using namespace surflect::bench;
  Arguments arguments;
  CLI::App app("Times a frame at the scale of the paper's doll, and how its cost grows.\n"
               "Options of Google Benchmark, as --benchmark_filter=growth, come last.\n"
               "Example: bench_doll --json > doll.json");
  std::string size = "1032x1360", output = "1024x768";
  const auto atMost = [](int most) { return CLI::Range(1, most); };
  app.add_option("--model", arguments.model,
                 "the doll's model, written on the first run; default: beside the build");
  app.add_option("--surfels", arguments.size.surfels, "of the model when it is written")
      ->capture_default_str()
      ->check(atMost(100'000'000));
  app.add_option("--views", arguments.size.views, "likewise")->capture_default_str()->check(atMost(9999));
  app.add_option("--lights", arguments.size.lights, "likewise")->capture_default_str()->check(atMost(9999));
  app.add_option("--size", size, "of its photographs, likewise")->capture_default_str();
  app.add_option("--output", output, "size of the frame")->capture_default_str();
  app.add_option("--shot-lights", arguments.lights, "lights of the frame")
      ->capture_default_str()
      ->check(atMost(9999));
  app.add_option("--frames", arguments.frames, "repetitions of each frame")
      ->capture_default_str()
      ->check(atMost(1000));
  app.add_flag("!--no-growth", arguments.growth, "leaves out the frames that show how the cost grows");
  auto* json = app.add_flag("--json", arguments.json, "one object on stdout instead of a table");
  app.allow_extras();
  try {
    app.parse(argc, argv);
    if (json->count() > 0 && !app.remaining().empty()) throw CLI::ExtrasError(app.remaining());
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    parseSize("--size", size, arguments.size.width, arguments.size.height);
    parseSize("--output", output, arguments.width, arguments.height);
    return run(arguments, app.remaining());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_doll: %s\n", error.what());
  }
  return 1;
}
