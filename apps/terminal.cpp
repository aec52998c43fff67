#include "apps/terminal.h"

#include <fmt/format.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>
#include <unistd.h>

namespace surflect {

namespace {

volatile std::sig_atomic_t interrupted = 0;

void interrupt(int) {
  interrupted = 1;
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool onTerminal() { return isatty(STDERR_FILENO) != 0; }

using Clock = std::chrono::steady_clock;

struct Line {
  std::mutex mutex;
  Clock::time_point last;
};

} // namespace

void watchSignals() {
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
  std::signal(SIGXFSZ, SIG_IGN);
}

Progress terminalProgress() {
  Progress progress;
  progress.cancelled = [] { return interrupted != 0; };
  auto line = std::make_shared<Line>();
  if (onTerminal()) {
    progress.report = [line](std::string_view stage, double fraction) {
      const std::lock_guard lock(line->mutex);
      const auto now = Clock::now();
      if (fraction < 1 && now - line->last < std::chrono::milliseconds(100)) return;
      line->last = now;
      fmt::print(stderr, "\r\033[K{} {:3.0f} %{}", stage, 100 * fraction, fraction < 1 ? "" : "\r\033[K");
      std::fflush(stderr);
    };
  } else {
    line->last = Clock::now();
    progress.report = [line](std::string_view stage, double fraction) {
      const std::lock_guard lock(line->mutex);
      if (Clock::now() - line->last < std::chrono::minutes(5)) return;
      line->last = Clock::now();
      say(fmt::format("{} {:.0f} %", stage, 100 * fraction));
    };
  }
  return progress;
}

void say(std::string_view line) {
  const std::string text = fmt::format("{}{}\n", onTerminal() ? "\r\033[K" : "", line);
  std::fputs(text.c_str(), stderr); // fmt::print would throw if stderr is closed
}

} // namespace surflect
