// Messages for people, on stderr; stdout is for the report.
#pragma once

#include "surfel/base/time.h"

#include <string_view>

namespace surflect {

// Makes Ctrl-C and SIGTERM ask the work to stop at its next checkpoint; a second signal ends the process. A
// write beyond the user's file size limit becomes an error of the writer.
void watchSignals();

// Progress line if stderr is a terminal, otherwise a line every five minutes for logs. Always checks for an
// interruption.
Progress terminalProgress();

// Prints a permanent line for people, on stderr.
void say(std::string_view line);

} // namespace surflect
