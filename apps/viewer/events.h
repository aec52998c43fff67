// Progress and remarks that pages wait for.
#pragma once

#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>

namespace surflect::viewer {

// The last events, numbered from 1. Safe from many threads.
class Events {
public:
  void add(nlohmann::json event) {
    {
      const std::lock_guard lock(mutex_);
      events_.push_back(std::move(event));
      if (events_.size() > kKept) events_.pop_front(), ++first_;
    }
    added_.notify_all();
  }

  // Adds the progress of a stage of work, but five times a second at most, and not in its first instant, when
  // it may be over at once.
  void progress(std::string_view stage, double fraction) {
    constexpr auto kPause = std::chrono::milliseconds(200);
    const auto now = std::chrono::steady_clock::now();
    nlohmann::json event = {{"kind", "progress"}, {"stage", stage}, {"fraction", fraction}};
    {
      const std::lock_guard lock(mutex_);
      if (stage != stage_) stage_ = stage, begin_ = now;
      if (now - begin_ < kPause || now - told_ < kPause) return;
      told_ = now;
      const double seconds = std::chrono::duration<double>(now - begin_).count();
      if (fraction > 0) event["secondsLeft"] = seconds * (1 - fraction) / fraction;
    }
    add(std::move(event));
  }

  // Events after a number, and the number of the last one: {"next", "events"}. Waits for the first of them
  // until the time is over, or end() is called.
  nlohmann::json after(uint64_t number, std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex_);
    const auto last = [&] { return first_ + events_.size() - 1; };
    if (number > last()) number = last(); // of a server before this one
    added_.wait_for(lock, patience, [&] { return isOver_ || last() > number; });
    nlohmann::json list = nlohmann::json::array();
    for (uint64_t i = std::max(number + 1, first_); i <= last(); ++i) list.push_back(events_[i - first_]);
    return {{"next", last()}, {"events", std::move(list)}};
  }

  // Lets all who wait go.
  void end() {
    {
      const std::lock_guard lock(mutex_);
      isOver_ = true;
    }
    added_.notify_all();
  }

private:
  static constexpr size_t kKept = 256;

  std::mutex mutex_;
  std::condition_variable added_;
  std::deque<nlohmann::json> events_;
  uint64_t first_ = 1; // number of the first one that is kept
  bool isOver_ = false;
  std::string stage_; // of the latest progress
  std::chrono::steady_clock::time_point begin_, told_;
};

} // namespace surflect::viewer
