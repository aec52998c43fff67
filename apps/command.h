// A subcommand of `surflect`: its options, and its work once they are parsed.
#pragma once

#include "apps/terminal.h"
#include "srf/capture/capture.h"
#include "surfel/base/error.h"
#include "surfel/base/time.h"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <functional>
#include <string>

namespace surflect {

using Json = nlohmann::ordered_json;

// Does the work and returns the machine-readable report. Throws Error or Cancelled.
using CommandWork = std::function<Json(const Progress& progress)>;

// Work that finished, but whose report states a failure: the report is written, and the program exits with 1.
class FailedReport : public Error {
public:
  FailedReport(std::string problem, Json report) : Error(std::move(problem)), report_(std::move(report)) {}
  const Json& report() const { return report_; }

private:
  Json report_;
};

// Work that a signal has stopped: the program exits with 128 and the signal's number, as shells have it.
class Interrupted : public Error {
  using Error::Error;
};

// Sets the work that runs if the command is chosen. An interruption becomes an Error that ends with `next`,
// what the user can do then.
inline void setWork(CLI::App& command, CommandWork& work, const std::string& next,
                    const CommandWork& chosen) {
  command.callback([=, &work] {
    work = [=](const Progress& progress) {
      try {
        return chosen(progress);
      } catch (const Cancelled&) {
        throw Interrupted("interrupted; " + next);
      }
    };
  });
}

// Add the subcommands; each sets `work` when chosen.
void addCaptureCommand(CLI::App& app, CommandWork& work);
void addImportCommand(CLI::App& app, CommandWork& work);
void addRelightCommand(CLI::App& app, CommandWork& work);
void addPackCommand(CLI::App& app, CommandWork& work);
void addRenderCommand(CLI::App& app, CommandWork& work);
void addExportCommand(CLI::App& app, CommandWork& work);
void addViewCommand(CLI::App& app, CommandWork& work);
void addDemoCommand(CLI::App& app, CommandWork& work);
void addScriptCommand(CLI::App& app, CommandWork& work);
void addEvaluateCommand(CLI::App& app, CommandWork& work);
void addChartCommand(CLI::App& app, CommandWork& work);
void addVerifyCommand(CLI::App& app, CommandWork& work);
void addInspectCommand(CLI::App& app, CommandWork& work);
void addWebCommand(CLI::App& app, CommandWork& work);

// Argument of commands that read a capture.
inline void addAllowOutside(CLI::App& command, capture::PathRule& outside) {
  command.add_flag_callback(
      "--allow-outside", [&outside] { outside = capture::PathRule::anywhere; },
      "the capture may name files outside of its folder");
}

struct CaptureArgument {
  std::string path;
  capture::PathRule outside = capture::PathRule::inside;

  // Reads the capture and prints the notes on how it was understood.
  capture::Capture read() const {
    capture::Capture capture = capture::readCapture(path, outside);
    for (const std::string& note : capture.notes) say(note);
    return capture;
  }
};

inline void addCaptureArgument(CLI::App& command, CaptureArgument& argument) {
  command.add_option("capture", argument.path, "folder with transforms.json, or a JSON file")->required();
  addAllowOutside(command, argument.outside);
}

} // namespace surflect
