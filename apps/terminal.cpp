#include "apps/terminal.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unistd.h>

namespace surflect {

namespace {

volatile std::sig_atomic_t interruptedBy = 0; // a signal
std::atomic<bool> jsonLines = false, lostEvents = false;

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

  // Takes note of a report; returns the seconds that the stage will still take, once that can be told.
  std::optional<double> secondsLeft(std::string_view now, double fraction) {
    if (now != stage || fraction < first) stage = now, begin = Clock::now(), first = fraction;
    const double elapsed = std::chrono::duration<double>(Clock::now() - begin).count();
    if (!(elapsed > 1 && fraction > first && fraction < 1)) return std::nullopt;
    return elapsed * (1 - fraction) / (fraction - first);
  }

  // "views  40 %, 1 min 5 s left"
  std::string textOf(double fraction, std::optional<double> left) const {
    return fmt::format("{} {:3.0f} %{}", stage, 100 * fraction, left ? ", " + timeText(*left) + " left" : "");
  }

  static std::string timeText(double seconds) {
    const auto whole = static_cast<long>(std::ceil(seconds));
    if (whole < 60) return fmt::format("{} s", whole);
    if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
    return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
  }
};

// Adds events of each report that begins or ends a stage, and of one in a tenth of a second.
void addProgressLines(Progress& progress) {
  auto line = std::make_shared<Line>();
  progress.report = [line, shown = progress.report](std::string_view stage, double fraction) {
    shown(stage, fraction);
    const std::lock_guard lock(line->mutex);
    const bool isNew = stage != line->stage;
    const auto left = line->secondsLeft(stage, fraction);
    const auto now = Clock::now();
    if (!isNew && fraction < 1 && now - line->last < std::chrono::milliseconds(100)) return;
    line->last = now;
    nlohmann::ordered_json fields = {{"stage", stage}, {"fraction", fraction}};
    if (left) fields["seconds_left"] = *left;
    event("progress", fields);
  };
}

} // namespace

void watchSignals() {
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
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
      const std::string text = line->textOf(fraction, line->secondsLeft(stage, fraction));
      if (!isNew && fraction < 1 && now - line->last < std::chrono::milliseconds(100)) return;
      line->last = now;
      fmt::print(stderr, "\r\033[K{}{}", text, fraction < 1 ? "" : "\r\033[K");
      std::fflush(stderr);
    };
  } else {
    line->last = Clock::now();
    progress.report = [line](std::string_view stage, double fraction) {
      const std::lock_guard lock(line->mutex);
      const std::string text = line->textOf(fraction, line->secondsLeft(stage, fraction));
      if (Clock::now() - line->last < std::chrono::seconds(10)) return;
      line->last = Clock::now();
      say(text);
    };
  }
  if (jsonLines) addProgressLines(progress);
  return progress;
}

void printJsonLines() { jsonLines = true; }

bool eventsAreLost() { return lostEvents; }

void event(std::string_view name, const nlohmann::ordered_json& fields) {
  using Json = nlohmann::ordered_json;
  if (!jsonLines) return;
  static std::mutex mutex; // whole lines, one after the other
  Json line = {{"event", name}};
  line.update(fields);
  const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
  const std::lock_guard lock(mutex);
  if (!jsonLines) return;
  if (std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0) return;
  say(std::string("standard output: cannot write events (") + std::strerror(errno) + "); the work goes on");
  jsonLines = false;
  lostEvents = true;
}

void say(std::string_view line) {
  const std::string text = fmt::format("{}{}\n", onTerminal() ? "\r\033[K" : "", line);
  std::fputs(text.c_str(), stderr); // fmt::print would throw if stderr is closed
}

} // namespace surflect
