// surflect: photographs in, deformed and relit film out.

#include "apps/command.h"
#include "apps/help.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "srf/image/exr.h"
#include "surfel/base/text.h"
#include "surfel/base/version.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <memory>
#include <new>
#include <thread>

namespace {

constexpr int kFailed = 1;
constexpr int kUsage = 2;

bool writeReport(const std::string& text) {
  return std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
}

// "unknown: --lihgts; did you mean --lights?" for the first option of the command line that the program does
// not know, or for its command; empty if it knows all.
std::string unknownWord(CLI::App& app, int argc, char** argv) {
  using namespace surflect;
  const bool hasCommand = !app.get_subcommands().empty();
  const CLI::App& command = hasCommand ? *app.get_subcommands().front() : app;
  std::vector<std::string> known;
  std::vector<const CLI::App*> groups{&command};
  for (const CLI::App* each : command.get_subcommands({}))
    each->get_name().empty() ? groups.push_back(each) : known.push_back(each->get_name());
  for (const CLI::App* group : groups)
    for (const CLI::Option* option : group->get_options())
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  for (int i = 1; i < argc; ++i) {
    const std::string word = std::string(argv[i]).substr(0, std::string(argv[i]).find('='));
    if (word == "--") break; // what follows are no options
    if ((hasCommand && !word.starts_with("--")) || std::ranges::find(known, word) != known.end()) continue;
    const std::vector<std::string_view> names(known.begin(), known.end());
    return fmt::format("unknown: {}{}", word, didYouMean(word, names));
  }
  return "";
}

int run(const surflect::CommandWork& work, int exrThreads, bool json) {
  using namespace surflect;
  Json report;
  int status = 0;
  try {
    image::setExrThreads(exrThreads);
    report = work(terminalProgress());
  } catch (const UsageError& error) {
    report["error"] = error.what();
    status = kUsage;
  } catch (const FailedReport& failure) {
    report = failure.report();
    report["error"] = failure.what();
    status = kFailed;
  } catch (const Interrupted& interruption) {
    report["error"] = interruption.what();
    status = 128 + interruptingSignal();
  } catch (const std::bad_alloc&) {
    report["error"] = "out of memory";
    status = kFailed;
  } catch (const std::exception& error) {
    const std::string text = error.what();
    const bool lacksThreads = text.find("Resource temporarily unavailable") != text.npos;
    report["error"] = text + (lacksThreads ? ": out of memory or threads; --threads 1 needs fewest" : "");
    status = kFailed;
  }
  if (status != 0) say("surflect: " + report["error"].get<std::string>());
  event("end", {{"status", status}, {"report", report}});
  if (eventsAreLost() && status == 0) status = kFailed;
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
  app.formatter(std::make_shared<HelpFormatter>());
  app.require_subcommand(1);
  app.set_version_flag("--version", kVersion);
  app.footer("Example: surflect pack examples/vase -o vase.srf && surflect render vase.srf -o frames/");

  CommandWork work;
  addImportCommand(app, work);
  addCaptureCommand(app, work);
  addRelightCommand(app, work);
  addPackCommand(app, work);
  addRenderCommand(app, work);
  addExportCommand(app, work);
  addDemoCommand(app, work);
  addScriptCommand(app, work);
  addViewCommand(app, work);
  addWebCommand(app, work);
  addEvaluateCommand(app, work);
  addChartCommand(app, work);
  addVerifyCommand(app, work);
  addInspectCommand(app, work);
  bool json = false, jsonLines = false;
  const size_t processors = std::max(1u, std::thread::hardware_concurrency());
  size_t threads = processors;
  for (CLI::App* command : app.get_subcommands({})) {
    CLI::Option* whole = command->add_flag("--json", json, "one machine-readable report on stdout");
    command->add_flag("--json-lines", jsonLines, "events and progress as lines of JSON on stdout")
        ->excludes(whole);
    command->add_option("--threads", threads, "how many threads to use")->check(CLI::Range(1, 1024));
  }

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) { // help, or the version
      app.exit(error);
      return std::fflush(stdout) == 0 && std::cout.flush() ? 0 : kFailed;
    }
    const std::string unknown = unknownWord(app, argc, argv); // may be why another is missing
    say("surflect: " + (unknown.empty() ? std::string(error.what()) : unknown));
    say(fmt::format("surflect {}--help explains", app.get_subcommands().empty()
                                                      ? std::string()
                                                      : app.get_subcommands().front()->get_name() + " "));
    return kUsage;
  }
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  watchSignals();
  if (jsonLines) printJsonLines();
  event("start", {{"command", app.get_subcommands().front()->get_name()}, {"version", kVersion}});
  return run(work, threads > 1 ? static_cast<int>(std::min(threads, processors)) : 0, json);
}
