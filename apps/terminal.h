// What people see while they wait: everything on stderr, so that stdout is the report's.
#pragma once

#include "surfel/base/progress.h"

#include <string_view>

namespace surflect {

// From now on Ctrl-C and SIGTERM ask work to stop at its next checkpoint; a second one of either ends the
// process. A file that grows beyond the user's limit is an error of its writer, not the end.
void watchSignals();

// A line that follows the work, when stderr is a terminal; elsewhere one every five minutes, for logs. Always
// asks whether the user has interrupted.
Progress terminalProgress();

// A lasting line for people; nothing when `quiet`.
void say(std::string_view line);

} // namespace surflect
