#include "apps/viewer/tabs.h"

#include <algorithm>

namespace surflect::viewer {

bool Tabs::admit(const std::string& tab, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  forgetClosed(now);
  if (!tabs_.contains(tab) && tabs_.size() >= kMostTabs) return false;
  tabs_[tab].seen = now;
  return true;
}

void Tabs::leave(const std::string& tab) {
  const std::lock_guard lock(mutex_);
  tabs_.erase(tab);
}

void Tabs::look(const std::string& tab, size_t model) {
  const std::lock_guard lock(mutex_);
  const auto open = tabs_.find(tab);
  if (open == tabs_.end()) return; // it has left meanwhile
  std::vector<size_t>& models = open->second.models;
  if (std::ranges::find(models, model) != models.end()) return;
  models.push_back(model);
  if (models.size() > 2) models.erase(models.begin());
}

bool Tabs::isOpen(const std::string& tab, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  forgetClosed(now);
  return tabs_.contains(tab);
}

std::vector<size_t> Tabs::unwatched(size_t models, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  forgetClosed(now);
  std::vector<size_t> unwatched;
  for (size_t model = 0; model < models; ++model)
    if (std::ranges::none_of(tabs_, [&](const auto& tab) {
          return std::ranges::find(tab.second.models, model) != tab.second.models.end();
        }))
      unwatched.push_back(model);
  return unwatched;
}

void Tabs::forgetClosed(Clock::time_point now) {
  std::erase_if(tabs_, [&](const auto& tab) { return now - tab.second.seen > kLife; });
}

} // namespace surflect::viewer
