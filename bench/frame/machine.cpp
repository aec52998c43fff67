#include "bench/frame/machine.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/frame/machine.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace surflect::bench::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Runs enough independent chains of multiply-adds to hide their latency, in registers. Returns the number of
// operations.
double multiplyAdds(float* sum) {
  constexpr int kChains = 12, kRounds = 4096;
  const hn::ScalableTag<float> lanes;
  const auto factor = hn::Set(lanes, 0.999f);
  decltype(hn::Zero(lanes)) chains[kChains];
  for (int i = 0; i < kChains; ++i) chains[i] = hn::Set(lanes, static_cast<float>(i));
  for (int round = 0; round < kRounds; ++round)
#pragma GCC unroll 12
    for (auto& chain : chains) chain = hn::MulAdd(chain, factor, factor);
  for (const auto& chain : chains) *sum += hn::GetLane(chain);
  return 2.0 * static_cast<double>(hn::Lanes(lanes)) * kChains * kRounds;
}

} // namespace surflect::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <benchmark/benchmark.h>

#include <thread>
#include <utility>
#include <vector>

namespace surflect::bench {

namespace {

HWY_EXPORT(multiplyAdds);

constexpr size_t kFloats = size_t{16} << 20, kPart = size_t{1} << 18;
// Many short runs, some of which are undisturbed on a shared machine.
constexpr int kRepetitions = 80, kIterations = 24;

// Sum of independent partial sums, without a dependency chain.
float sumOf(const float* a) {
  constexpr size_t kLanes = 64;
  float lanes[kLanes] = {}, sum = 0;
  for (size_t i = 0; i < kPart; i += kLanes)
    for (size_t lane = 0; lane < kLanes; ++lane) lanes[lane] += a[i + lane];
  for (const float lane : lanes) sum += lane;
  return sum;
}

// Walks through the arrays of one thread, part by part.
struct Stream {
  std::vector<float> a = std::vector<float>(kFloats, 1.f), b = a, c = a;
  size_t part = 0;

  void run(benchmark::State& state, int64_t arrays, void (*kernel)(float* a, float* b, float* c)) {
    for (auto _ : state) {
      const size_t begin = part++ * kPart % kFloats;
      kernel(&a[begin], &b[begin], &c[begin]);
    }
    state.SetBytesProcessed(arrays * static_cast<int64_t>(kPart * sizeof(float)) * state.iterations());
  }
};

Stream& streamOfThread(const benchmark::State& state) {
  static std::vector<Stream> streams(std::thread::hardware_concurrency());
  return streams[static_cast<size_t>(state.thread_index())];
}

void read(benchmark::State& state) {
  streamOfThread(state).run(state, 1, [](float* a, float*, float*) { benchmark::DoNotOptimize(sumOf(a)); });
}

void triad(benchmark::State& state) {
  streamOfThread(state).run(state, 3, [](float* a, float* b, float* c) {
    for (size_t i = 0; i < kPart; ++i) a[i] = b[i] + 3.f * c[i];
    benchmark::ClobberMemory();
  });
}

void multiplyAdd(benchmark::State& state) {
  double flops = 0;
  float sum = 0;
  for (auto _ : state) flops += HWY_DYNAMIC_DISPATCH(multiplyAdds)(&sum);
  benchmark::DoNotOptimize(sum);
  state.counters["flops"] = benchmark::Counter(flops, benchmark::Counter::kIsRate);
}

} // namespace

void registerMachine() {
  const std::pair<const char*, void (*)(benchmark::State&)> limits[] = {
      {"machine/read", read}, {"machine/triad", triad}, {"machine/multiply-add", multiplyAdd}};
  for (const auto& [name, run] : limits)
    benchmark::RegisterBenchmark(name, run)
        ->Threads(static_cast<int>(std::thread::hardware_concurrency()))
        ->UseRealTime()
        ->Iterations(kIterations)
        ->Repetitions(kRepetitions);
}

} // namespace surflect::bench
#endif
