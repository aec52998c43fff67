#include "render/session/session.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <cassert>

namespace surflect::session {

Session::Session(std::vector<Open> models, Progress progress)
    : models_(std::move(models)), progress_(std::move(progress)), renderers_(models_.size()),
      isClosing_(models_.size(), false), thread_([this] { serve(); }) {}

Session::~Session() {
  {
    const std::lock_guard lock(mutex_);
    isEnding_ = true;
  }
  asked_.notify_all();
  thread_.join();
  std::unique_lock lock(mutex_);
  done_.wait(lock, [&] { return callers_ == 0; });
}

void Session::run(const std::string& client, size_t model, Urgency urgency, const Work& work) {
  assert(model < models_.size());
  Job job{client, model, urgency, work};
  std::unique_lock lock(mutex_);
  if (isEnding_) throw Cancelled();
  ++callers_;
  for (Job* const older : waiting_)
    if (older->client == client) older->isSuperseded = older->isDone = true;
  std::erase_if(waiting_, [](const Job* older) { return older->isDone; });
  if (current_ && current_->client == client && current_->urgency == Urgency::full)
    current_->isSuperseded = true;
  waiting_.push_back(&job);
  asked_.notify_all();
  done_.notify_all();
  done_.wait(lock, [&] { return job.isDone; });
  --callers_;
  if (callers_ == 0) done_.notify_all();
  if (job.isSuperseded) throw Superseded();
  if (job.problem) std::rethrow_exception(job.problem);
}

void Session::close(size_t model) {
  {
    const std::lock_guard lock(mutex_);
    isClosing_[model] = true;
  }
  asked_.notify_all();
}

void Session::serve() {
  std::unique_lock lock(mutex_);
  for (;;) {
    asked_.wait(lock, [&] {
      return isEnding_ || !waiting_.empty() || std::ranges::find(isClosing_, true) != isClosing_.end();
    });
    if (isEnding_) break;
    for (size_t model = 0; model < models_.size(); ++model) {
      if (!isClosing_[model]) continue;
      isClosing_[model] = false;
      if (std::ranges::any_of(waiting_, [&](const Job* job) { return job->model == model; })) continue;
      lock.unlock();
      renderers_[model].reset();
      lock.lock();
    }
    if (waiting_.empty()) continue;
    Job& job = *waiting_.front();
    waiting_.pop_front();
    current_ = &job;
    lock.unlock();
    perform(job);
    lock.lock();
    current_ = nullptr;
    job.isDone = true;
    done_.notify_all();
  }
  for (Job* const job : waiting_) {
    job->problem = std::make_exception_ptr(Cancelled());
    job->isDone = true;
  }
  done_.notify_all();
  lock.unlock();
  renderers_.clear(); // on the thread that made them
}

void Session::perform(Job& job) {
  Progress opening = progress_, working = progress_; // a model is not opened in vain
  opening.cancelled = [&] {
    if (progress_.cancelled && progress_.cancelled()) return true;
    const std::lock_guard lock(mutex_);
    return isEnding_;
  };
  working.cancelled = [&] {
    if (opening.cancelled()) return true;
    const std::lock_guard lock(mutex_);
    return job.isSuperseded;
  };
  try {
    std::unique_ptr<method::Renderer>& renderer = renderers_[job.model];
    if (!renderer) renderer = models_[job.model](opening);
    job.work(*renderer, working);
    const std::lock_guard lock(mutex_);
    job.isSuperseded = false; // it has ended all the same
  } catch (...) {
    job.problem = std::current_exception();
  }
}

} // namespace surflect::session
