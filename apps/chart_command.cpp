#include "apps/command.h"
#include "apps/help.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "render/chart/make_chart.h"
#include "render/chart/subject.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"
#include "surfel/math/simd.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <set>
#include <span>
#include <thread>

namespace surflect {

namespace {

struct ChartArguments {
  std::vector<std::string> paths; // models, then the capture
  std::string bent, script, output;
  capture::PathRule outside = capture::PathRule::inside;
  double frame = 1;
  std::vector<std::string> sweeps; // NAME=V1,V2,..
  MethodOptions given;
  chart::ChartOptions options;
};

// Throws UsageError for an option that no model has, and for one that is swept twice.
std::vector<method::Sweep> sweepsOf(const ChartArguments& arguments,
                                    std::span<const method::Method* const> methods) {
  std::vector<method::Option> rows;
  for (const method::Method* method : methods)
    rows.insert(rows.end(), method->renderOptions.begin(), method->renderOptions.end());
  rows.push_back(chart::scaleOption());
  try {
    std::vector<method::Sweep> sweeps;
    for (const std::string& text : arguments.sweeps) {
      method::Sweep sweep = method::parseSweep({methods.front()->tag, rows}, text);
      if (method::rowOf({methods.front()->tag, rows}, sweep.name).atOpening)
        throw Error("cannot be swept: it is given when a model is opened").at(sweep.name).at("--sweep");
      if (arguments.given.isGiven(sweep.name)) throw Error("is swept, too").at(method::flagOf(sweep.name));
      if (std::ranges::find(sweeps, sweep.name, &method::Sweep::name) != sweeps.end())
        throw Error("is given twice").at(sweep.name).at("--sweep");
      sweeps.push_back(std::move(sweep));
    }
    return sweeps;
  } catch (const Error& error) {
    throw UsageError(error);
  }
}

// Name of the processor, number of threads and vector instructions.
std::string machine() {
  std::string name = "unknown processor";
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) {
      name = line.substr(std::min(line.size(), line.find(':') + 2));
      break;
    }
  const size_t threads = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return fmt::format("{}, {}, {}", name, counted(threads, "thread"), nameOf(bestSimd()));
}

// Warning that other work takes time of the processors; empty if it is less than that of one.
std::string busyMachine() {
  double load = 0;
  const unsigned processors = std::max(1u, std::thread::hardware_concurrency());
  if (getloadavg(&load, 1) < 1 || load < 1) return "";
  return fmt::format(
      "warning: the machine is busy (load {:.1f} of {} processors in the last minute), so that "
      "times may be too long",
      load, processors);
}

// A word as the shell reads it back.
std::string shellWord(const std::string& text) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=,./:@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string escaped;
  for (const char c : text) escaped.append(c == '\'' ? "'\\''" : std::string_view(&c, 1));
  return fmt::format("'{}'", escaped);
}

// Options of the command that must be given again, except those that are named.
std::string optionsAgain(const CLI::App& command, const std::vector<std::string>& except) {
  std::string text;
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_positional() || std::ranges::count(except, option->get_name()) ||
        (!except.empty() && option->get_group() == kMethodGroup && std::ranges::count(except, kMethodGroup)))
      continue;
    if (option->get_expected_max() == 0) {
      text += fmt::format(" {}", option->get_name());
      continue;
    }
    for (const std::string& value : option->results())
      text += fmt::format(" {} {}", option->get_name(), shellWord(value));
  }
  return text;
}

Json runChart(ChartArguments& arguments, const Progress& progress) {
  if (arguments.paths.size() < 2) throw UsageError(Error("give one or more models, then their capture"));
  const std::vector<std::filesystem::path> models(arguments.paths.begin(), arguments.paths.end() - 1);
  std::set<std::filesystem::path> distinct;
  for (const std::filesystem::path& model : models)
    if (!distinct.insert(std::filesystem::weakly_canonical(model / "")).second)
      throw Error("the model is given twice").in(model);
  std::vector<const method::Method*> methods;
  for (const std::filesystem::path& model : models) methods.push_back(&method::methodOfModel(model));
  arguments.options.settings = arguments.given.settingsFor(methods);
  arguments.options.sweep = sweepsOf(arguments, methods);
  requireCreatable(arguments.output);
  const capture::Capture capture = CaptureArgument{arguments.paths.back(), arguments.outside}.read();
  std::optional<chart::BentTruth> bent;
  if (!arguments.bent.empty())
    bent = {CaptureArgument{arguments.bent, arguments.outside}.read(), arguments.script, arguments.frame};
  createFolder(arguments.output);
  if (const std::string warning = busyMachine(); !warning.empty()) say(warning);
  const chart::Chart chart =
      chart::makeChart(models, capture, bent, arguments.output, arguments.options, progress);
  chart::writeChart(chart, arguments.output);
  const auto onFront = std::ranges::count_if(chart.points, &chart::Point::isOnFront);
  say(fmt::format("{}, {} of them on the Pareto front; open {}", counted(chart.points.size(), "setting"),
                  onFront, (std::filesystem::path(arguments.output) / "index.html").string()));
  return Json::parse(chart::jsonOf(chart));
}

} // namespace

void addChartCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<ChartArguments>();
  CLI::App* command = app.add_subcommand("chart", "chart the speed of settings against their accuracy");
  command->footer("Example: surflect chart vase.srf examples/vase --sweep pairs=6,4,2 "
                  "--sweep surfel_size=0,1,2 -o report/");
  command
      ->add_option_function<std::vector<std::string>>(
          "paths", [arguments](const std::vector<std::string>& paths) { arguments->paths = paths; },
          "one or more packed models, then the capture that they were packed of")
      ->option_text("MODEL... CAPTURE")
      ->required();
  command->add_option("-o,--output", arguments->output, "folder for the report")
      ->required()
      ->check(notEmpty());
  addAllowOutside(*command, arguments->outside);
  command
      ->add_option(
          "--sweep", arguments->sweeps,
          "values of an option, with every value of the others that are swept; default: every option "
          "alone, the preview, and a greedy descent")
      ->allow_extra_args(false)
      ->check([](const std::string& text) {
        const size_t equals = text.find('=');
        const bool isWhole = equals > 0 && equals != std::string::npos && equals + 1 < text.size();
        return isWhole ? "" : "found '" + text + "', expected NAME=V1,V2,..";
      })
      ->option_text("NAME=V1,V2,.. ...");
  command->add_flag("--only", arguments->options.onlyGiven,
                    "the given values alone; without --sweep, full accuracy alone");
  CLI::Option* bent = command->add_option("--bent", arguments->bent, "a capture of the object, deformed");
  CLI::Option* script =
      command->add_option("--script", arguments->script, "warps that the deformed object went through");
  bent->needs(script);
  script->needs(bent);
  command->add_option("--frame", arguments->frame, "frame of the script")
      ->capture_default_str()
      ->check(frameNumber())
      ->needs(script);
  const auto atLeastOne = CLI::Range(size_t{1}, size_t{1000000});
  command->add_option("--frames", arguments->options.frames, "held-out photographs to compare with, at most")
      ->capture_default_str()
      ->check(atLeastOne);
  command
      ->add_option("--timed-frames", arguments->options.timedFrames,
                   "held-out photographs whose rendering is timed, at most")
      ->capture_default_str()
      ->check(atLeastOne);
  command->add_option("--rounds", arguments->options.rounds, "rounds of timing over all settings")
      ->capture_default_str()
      ->check(atLeastOne);
  addSimd(*command);
  arguments->given.add(*command, MethodOptions::Kind::render, [arguments] {
    return arguments->paths.empty() ? nullptr : methodAt(arguments->paths.front());
  });
  setWork(*command, work, "the same command goes on from here",
          [arguments, command](const Progress& progress) {
            chart::ChartOptions& options = arguments->options;
            options.machine = machine();
            options.announce = say;
            std::string paths;
            for (const std::string& path : arguments->paths) paths += fmt::format(" {}", shellWord(path));
            options.command = "surflect chart" + paths + optionsAgain(*command, {"--json"});
            const std::string again =
                optionsAgain(*command, {"--json", "--sweep", "--only", "--output", "--preset", kMethodGroup});
            options.commandOf = [=](const std::filesystem::path& model, const method::Setting& setting) {
              std::string text = fmt::format("surflect chart {} {}{}", shellWord(model.string()),
                                             shellWord(arguments->paths.back()), again);
              for (const auto& [name, value] : arguments->options.settings[method::methodOfModel(model).tag])
                text += fmt::format(" {} {}", method::flagOf(name), value.text());
              for (const auto& [name, value] : setting)
                text += fmt::format(" --sweep {}={}", name, value.text());
              return text + " --only -o point/";
            };
            return runChart(*arguments, progress);
          });
}

} // namespace surflect
