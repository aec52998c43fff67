// surflect: photographs in, deformed and relit film out.

#include "apps/command.h"
#include "apps/terminal.h"
#include "srf/image/exr.h"
#include "surfel/base/version.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>
#include <thread>

namespace {

constexpr int kFailed = 1;
constexpr int kUsage = 2;

bool writeReport(const std::string& text) {
  return std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
}

int run(const surflect::CommandWork& work, int exrThreads, bool json) {
  using namespace surflect;
  Json report;
  int status = 0;
  try {
    image::setExrThreads(exrThreads);
    report = work(terminalProgress());
  } catch (const FailedReport& failure) {
    report = failure.report();
    report["error"] = failure.what();
    status = kFailed;
  } catch (const std::bad_alloc&) {
    report["error"] = "out of memory";
    status = kFailed;
  } catch (const std::exception& error) {
    report["error"] = error.what();
    status = kFailed;
  }
  if (status != 0) say("surflect: " + report["error"].get<std::string>());
  if (json && !writeReport(report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n")) {
    say(std::string("surflect: standard output: cannot write the report (") + std::strerror(errno) + ")");
    status = kFailed;
  }
  return status;
}

} // namespace

int main(int argc, char** argv) {
  using namespace surflect;
  CLI::App app("Deforms, relights and renders captured surface reflectance fields.", "surflect");
  app.require_subcommand(1);
  app.set_version_flag("--version", kVersion);
  app.footer(
      "Example: surflect pack examples/vase -o vase.srf && surflect render examples/film.toml -o frames/");

  CommandWork work;
  addImportCommand(app, work);
  addCaptureCommand(app, work);
  addRelightCommand(app, work);
  addPackCommand(app, work);
  addRenderCommand(app, work);
  addEvaluateCommand(app, work);
  addChartCommand(app, work);
  addLightFieldCommand(app, work);
  addVerifyCommand(app, work);
  addInspectCommand(app, work);
  bool json = false;
  const size_t processors = std::max(1u, std::thread::hardware_concurrency());
  size_t threads = processors;
  for (CLI::App* command : app.get_subcommands({})) {
    command->add_flag("--json", json, "one machine-readable report on stdout");
    command->add_option("--threads", threads, "how many threads to use")->check(CLI::Range(1, 1024));
  }

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  watchSignals();
  return run(work, threads > 1 ? static_cast<int>(std::min(threads, processors)) : 0, json);
}
