#include "apps/terminal.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>
#include <unistd.h>

namespace surflect {

namespace {

volatile std::sig_atomic_t interruptedBy = 0; // a signal

void interrupt(int signal) {
  interruptedBy = signal;
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool onTerminal() { return isatty(STDERR_FILENO) != 0; }

using Clock = std::chrono::steady_clock;

// Progress as it was last shown.
struct Line {
  std::mutex mutex;
  Clock::time_point last;
  std::string stage;
  Clock::time_point begin; // of the stage
  double first = 0;        // fraction at which the stage was first heard of: some begin with what is there

  // "views  40 %, 1 min 5 s left"
  std::string textOf(std::string_view now, double fraction) {
    if (now != stage || fraction < first) stage = now, begin = Clock::now(), first = fraction;
    const double elapsed = std::chrono::duration<double>(Clock::now() - begin).count();
    std::string text = fmt::format("{} {:3.0f} %", stage, 100 * fraction);
    if (elapsed > 1 && fraction > first && fraction < 1)
      text += ", " + timeText(elapsed * (1 - fraction) / (fraction - first)) + " left";
    return text;
  }

  static std::string timeText(double seconds) {
    const auto whole = static_cast<long>(std::ceil(seconds));
    if (whole < 60) return fmt::format("{} s", whole);
    if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
    return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
  }
};

} // namespace

void watchSignals() {
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
  std::signal(SIGXFSZ, SIG_IGN);
}

int interruptingSignal() { return interruptedBy; }

Progress terminalProgress() {
  Progress progress;
  progress.cancelled = [] { return interruptedBy != 0; };
  auto line = std::make_shared<Line>();
  if (onTerminal()) {
    progress.report = [line](std::string_view stage, double fraction) {
      const std::lock_guard lock(line->mutex);
      const auto now = Clock::now();
      const bool isNew = stage != line->stage; // shown at once, as the next report may come late
      const std::string text = line->textOf(stage, fraction);
      if (!isNew && fraction < 1 && now - line->last < std::chrono::milliseconds(100)) return;
      line->last = now;
      fmt::print(stderr, "\r\033[K{}{}", text, fraction < 1 ? "" : "\r\033[K");
      std::fflush(stderr);
    };
  } else {
    line->last = Clock::now();
    progress.report = [line](std::string_view stage, double fraction) {
      const std::lock_guard lock(line->mutex);
      const std::string text = line->textOf(stage, fraction);
      if (Clock::now() - line->last < std::chrono::seconds(10)) return;
      line->last = Clock::now();
      say(text);
    };
  }
  return progress;
}

void say(std::string_view line) {
  const std::string text = fmt::format("{}{}\n", onTerminal() ? "\r\033[K" : "", line);
  std::fputs(text.c_str(), stderr); // fmt::print would throw if stderr is closed
}

} // namespace surflect
