// Messages for people, on stderr; the report, or events for programs, on stdout.
#pragma once

#include "surfel/base/time.h"

#include <nlohmann/json_fwd.hpp>

#include <string_view>

namespace surflect {

// Makes Ctrl-C and SIGTERM ask the work to stop at its next checkpoint; a second signal ends the process. A
// write beyond the user's file size limit, or to a pipe whose reader has ended, becomes an error of the
// writer.
void watchSignals();
// The signal that asked the work to stop; 0 if none has.
int interruptingSignal();

// Progress of the present stage with the time that it will still take: one line that changes if stderr is a
// terminal, otherwise a line every ten seconds. Always checks for an interruption.
Progress terminalProgress();

// Whether stdout has refused an event.
bool eventsAreLost();

// Prints a permanent line for people, on stderr.
void say(std::string_view line);

// Makes progress and events also lines of JSON on stdout, each flushed (docs/outputs.md); off at first.
void printJsonLines();
// Prints {"event": name, ...fields} as a line, if they are on. From any thread. The first line that cannot be
// written turns them off, with a message: the work goes on.
void event(std::string_view name, const nlohmann::ordered_json& fields);

} // namespace surflect
