// Pages that are open: who may ask, and which models are still looked at.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace surflect::viewer {

// Most pages at a time.
inline constexpr size_t kMostTabs = 8;

// Safe from many threads.
class Tabs {
public:
  using Clock = std::chrono::steady_clock;
  // A page counts as closed after so long without a request; pages ask for events every 20 s.
  static constexpr std::chrono::seconds kLife{45};

  // Takes note of a page that asks for something; false if there are too many.
  bool admit(const std::string& tab, Clock::time_point now = Clock::now());
  // Forgets a page.
  void leave(const std::string& tab);
  // Takes note of the model that an open page looks at; the last two count, as A and B.
  void look(const std::string& tab, size_t model);

  bool isOpen(const std::string& tab, Clock::time_point now = Clock::now());
  // Which of the models 0 .. models - 1 no open page looks at.
  std::vector<size_t> unwatched(size_t models, Clock::time_point now = Clock::now());

private:
  struct Tab {
    Clock::time_point seen;
    std::vector<size_t> models;
  };
  void forgetClosed(Clock::time_point now); // with mutex_ held

  std::mutex mutex_;
  std::map<std::string, Tab> tabs_;
};

} // namespace surflect::viewer
