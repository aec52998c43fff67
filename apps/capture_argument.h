// Argument of commands that read a capture.
#pragma once

#include "apps/command.h"
#include "apps/terminal.h"
#include "srf/capture/capture.h"

#include <string>

namespace surflect {

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
