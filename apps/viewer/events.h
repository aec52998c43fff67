// Progress and remarks that pages wait for.
#pragma once

#include <nlohmann/json.hpp>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>

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
};

} // namespace surflect::viewer
