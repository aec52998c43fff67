// Messages for people, on stderr; stdout is for the report.
#pragma once

#include "surfel/base/time.h"

#include <nlohmann/json_fwd.hpp>

#include <string_view>

namespace surflect {

// Makes Ctrl-C and SIGTERM ask the work to stop at its next checkpoint; a second signal ends the process. A
// write beyond the user's file size limit becomes an error of the writer.
void watchSignals();
// The signal that asked the work to stop; 0 if none has.
int interruptingSignal();

// Progress of the present stage with the time that it will still take: one line that changes if stderr is a
// terminal, otherwise a line every ten seconds. Always checks for an interruption.
Progress terminalProgress();

// Prints a permanent line for people, on stderr.
void say(std::string_view line);

// Makes progress and events also lines of JSON on stdout, each flushed (docs/exports.md); off at first.
void printJsonLines();
// Prints {"event": name, ...fields} as a line, if they are on. From any thread. Returns false if stdout
// cannot be written to.
bool event(std::string_view name, const nlohmann::ordered_json& fields);

} // namespace surflect
