#include "render/session/session.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <thread>

namespace surflect::session {
namespace {

using namespace std::chrono_literals;

// A renderer of nothing, which notes on which thread it is opened and closed.
class Stub : public method::Renderer {
public:
  struct Log {
    std::atomic<int> opened = 0, closed = 0;
    std::thread::id openedOn = {}, closedOn = {};
  };
  explicit Stub(Log& log) : log_(log) {
    ++log_.opened;
    log_.openedOn = std::this_thread::get_id();
  }
  ~Stub() override {
    ++log_.closed;
    log_.closedOn = std::this_thread::get_id();
  }
  const method::Description& describe() const override { return description_; }
  std::span<const method::Option> options() const override { return {}; }
  method::FrameLayers render(const scene::Scene&, const std::vector<std::string>&, const Progress&,
                             method::FrameLayers) override {
    return {};
  }

private:
  void configure(const method::Setting&) override {}
  Log& log_;
  method::Description description_ = {};
};

Session::Open opener(Stub::Log& log) {
  return [&log](const Progress&) { return std::make_unique<Stub>(log); };
}

void waitFor(const std::function<bool()>& isSo) {
  for (int i = 0; i < 5000 && !isSo(); ++i) std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(isSo());
}

// Work that goes on until it is told to end, or given up.
struct Endless {
  std::atomic<bool> begun = false, mayEnd = false;
  Session::Work work() {
    return [this](method::Renderer&, const Progress& progress) {
      begun = true;
      while (!mayEnd) {
        progress.checkpoint();
        std::this_thread::sleep_for(1ms);
      }
    };
  }
};

TEST(Session, OneThreadOpensUsesAndClosesARenderer) {
  Stub::Log log;
  std::thread::id usedOn;
  {
    Session session({opener(log)}, {});
    EXPECT_EQ(log.opened, 0);
    for (int i = 0; i < 3; ++i)
      session.run("tab", 0, Urgency::full,
                  [&](method::Renderer&, const Progress&) { usedOn = std::this_thread::get_id(); });
    EXPECT_EQ(log.opened, 1);
    EXPECT_EQ(log.openedOn, usedOn);
    EXPECT_NE(usedOn, std::this_thread::get_id());
  }
  EXPECT_EQ(log.closed, 1);
  EXPECT_EQ(log.closedOn, usedOn);
}

TEST(Session, AFullFrameGivesWayToANewerStateOfItsClient) {
  Stub::Log log;
  Session session({opener(log)}, {});
  Endless frame;
  auto older = std::async(std::launch::async, [&] { session.run("tab", 0, Urgency::full, frame.work()); });
  waitFor([&] { return frame.begun.load(); });
  bool hasRun = false;
  session.run("tab", 0, Urgency::preview, [&](method::Renderer&, const Progress&) { hasRun = true; });
  EXPECT_TRUE(hasRun);
  EXPECT_THROW(older.get(), Superseded);
}

TEST(Session, AFullFrameOfAnotherClientGoesOn) {
  Stub::Log log;
  Session session({opener(log)}, {});
  Endless frame;
  auto older = std::async(std::launch::async, [&] { session.run("a", 0, Urgency::full, frame.work()); });
  waitFor([&] { return frame.begun.load(); });
  auto other = std::async(std::launch::async, [&] {
    session.run("b", 0, Urgency::preview, [](method::Renderer&, const Progress&) {});
  });
  EXPECT_EQ(other.wait_for(30ms), std::future_status::timeout);
  frame.mayEnd = true;
  EXPECT_NO_THROW(older.get());
  EXPECT_NO_THROW(other.get());
}

TEST(Session, APreviewRunsToItsEnd) {
  Stub::Log log;
  Session session({opener(log)}, {});
  Endless preview;
  auto older =
      std::async(std::launch::async, [&] { session.run("tab", 0, Urgency::preview, preview.work()); });
  waitFor([&] { return preview.begun.load(); });
  auto newer = std::async(std::launch::async, [&] {
    session.run("tab", 0, Urgency::full, [](method::Renderer&, const Progress&) {});
  });
  EXPECT_EQ(newer.wait_for(30ms), std::future_status::timeout);
  preview.mayEnd = true;
  EXPECT_NO_THROW(older.get());
  EXPECT_NO_THROW(newer.get());
}

// Many states come while one is being drawn: the last one alone is drawn then.
TEST(Session, TheLatestStateWins) {
  Stub::Log log;
  Session session({opener(log)}, {});
  Endless preview;
  auto first =
      std::async(std::launch::async, [&] { session.run("tab", 0, Urgency::preview, preview.work()); });
  waitFor([&] { return preview.begun.load(); });
  std::atomic<int> drawn = 0, superseded = 0, last = -1;
  std::vector<std::future<void>> states;
  for (int state = 0; state < 20; ++state) {
    states.push_back(std::async(std::launch::async, [&, state] {
      try {
        session.run("tab", 0, Urgency::preview, [&](method::Renderer&, const Progress&) {
          ++drawn;
          last = state;
        });
      } catch (const Superseded&) {
        ++superseded;
      }
    }));
    // The state before gives way as soon as this one is there; the first one finds none.
    if (state == 0) std::this_thread::sleep_for(100ms);
    waitFor([&] { return superseded == state; });
  }
  preview.mayEnd = true;
  first.get();
  for (auto& state : states) state.get();
  EXPECT_EQ(drawn, 1);
  EXPECT_EQ(superseded, 19);
  EXPECT_EQ(last, 19);
}

TEST(Session, WhatWorkThrowsReachesItsClientAndTheNextOneIsServed) {
  Stub::Log log;
  Session session(
      {opener(log),
       [](const Progress&) -> std::unique_ptr<method::Renderer> { throw Error("cannot be opened"); }},
      {});
  const auto fail = [](method::Renderer&, const Progress&) { throw Error("a mistake"); };
  EXPECT_THROW(session.run("tab", 0, Urgency::full, fail), Error);
  EXPECT_THROW(session.run("tab", 1, Urgency::full, fail), Error);
  EXPECT_NO_THROW(session.run("tab", 0, Urgency::full, [](method::Renderer&, const Progress&) {}));
}

TEST(Session, AClosedModelIsOpenedAgain) {
  Stub::Log log;
  Session session({opener(log)}, {});
  const auto nothing = [](method::Renderer&, const Progress&) {};
  session.run("tab", 0, Urgency::full, nothing);
  session.close(0);
  waitFor([&] { return log.closed == 1; });
  session.run("tab", 0, Urgency::full, nothing);
  EXPECT_EQ(log.opened, 2);
}

TEST(Session, ItsEndGivesUpAllWork) {
  Stub::Log log;
  auto session = std::make_unique<Session>(std::vector{opener(log)}, Progress{});
  Endless frame;
  auto working =
      std::async(std::launch::async, [&] { session->run("a", 0, Urgency::preview, frame.work()); });
  waitFor([&] { return frame.begun.load(); });
  auto waiting = std::async(std::launch::async, [&] {
    session->run("b", 0, Urgency::full, [](method::Renderer&, const Progress&) {});
  });
  std::this_thread::sleep_for(100ms);
  session.reset();
  EXPECT_THROW(working.get(), Cancelled);
  EXPECT_THROW(waiting.get(), Cancelled);
  EXPECT_EQ(log.closed, 1);
}

TEST(Session, ManyClientsAreServed) {
  Stub::Log log;
  Session session({opener(log), opener(log)}, {});
  std::atomic<int> done = 0;
  std::vector<std::future<void>> clients;
  for (int client = 0; client < 16; ++client)
    clients.push_back(std::async(std::launch::async, [&, client] {
      for (int state = 0; state < 50; ++state)
        session.run("tab " + std::to_string(client), static_cast<size_t>(state) % 2, Urgency::full,
                    [&](method::Renderer&, const Progress&) { ++done; });
    }));
  for (auto& client : clients) client.get();
  EXPECT_EQ(done, 16 * 50);
}

} // namespace
} // namespace surflect::session
