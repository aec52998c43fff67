#include "bench/doll/machine.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <immintrin.h>
#include <sched.h>
#include <unistd.h>

namespace surflect::bench {

namespace {

using Clock = std::chrono::steady_clock;

// Of one run, about: short enough for some of them to have the processor to themselves on a machine that is
// shared.
constexpr double kSeconds = 0.0015;
constexpr int kRuns = 80;
constexpr size_t kArrayFloats = size_t{16} << 20, kPartFloats = size_t{1} << 18;
constexpr size_t kReadBytes = size_t{64} << 10;
constexpr int kQueueDepth = 32;

// Keeps a value from being optimised away.
template <class T> void use(const T& value) { asm volatile("" : : "g"(&value) : "memory"); }

std::vector<int> processorsOfProcess() {
  cpu_set_t set;
  CPU_ZERO(&set);
  ::sched_getaffinity(0, sizeof set, &set);
  std::vector<int> processors;
  for (int i = 0; i < CPU_SETSIZE; ++i)
    if (CPU_ISSET(i, &set)) processors.push_back(i);
  return processors.empty() ? std::vector{0} : processors;
}

// Or a busy machine may let two threads take turns on one processor.
void stayOn(int processor) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(processor, &set);
  ::sched_setaffinity(0, sizeof set, &set); // of this thread; a refusal costs accuracy only
}

// Where threads wait for each other. They keep their processors meanwhile, where there is one for each: a
// thread that sleeps comes back too late on a machine that others use.
class Together {
public:
  explicit Together(int threads) : threads_(threads), yields_(threads > allThreads()) {}
  // Returns when the last one has come; the same moment for all.
  Clock::time_point meet() {
    const unsigned round = round_.load();
    if (waiting_.fetch_add(1) + 1 == threads_) {
      waiting_ = 0;
      start_ = Clock::now();
      ++round_;
    }
    while (round_.load() == round)
      if (yields_) std::this_thread::yield();
    return start_;
  }

private:
  int threads_;
  bool yields_;
  std::atomic<int> waiting_ = 0;
  std::atomic<unsigned> round_ = 0;
  Clock::time_point start_;
};

// Amount of work a second of all threads together. makeWorker(thread) allocates; the worker it gives does
// some work at each call, and returns how much.
using Worker = std::function<double()>;
double rateOf(int threads, const std::function<Worker(int thread)>& makeWorker) {
  struct Share {
    double done = 0;
    Clock::time_point end;
  };
  std::vector<Share> shares(static_cast<size_t>(threads));
  Together together(threads);
  double best = 0;
  const auto run = [&](int thread) {
    const Worker work = makeWorker(thread);
    work(); // memory is mapped, caches and clocks are warm
    for (int i = 0; i < kRuns; ++i) {
      const auto begin = together.meet();
      Share& share = shares[static_cast<size_t>(thread)] = {};
      do {
        share.done += work();
        share.end = Clock::now();
      } while (std::chrono::duration<double>(share.end - begin).count() < kSeconds);
      together.meet();
      if (thread != 0) continue;
      double done = 0;
      Clock::time_point end = begin;
      for (const Share& one : shares) {
        done += one.done;
        end = std::max(end, one.end);
      }
      best = std::max(best, done / std::chrono::duration<double>(end - begin).count());
    }
  };
  const std::vector<int> processors = processorsOfProcess();
  std::vector<std::jthread> pool;
  for (int thread = 0; thread < threads; ++thread)
    pool.emplace_back([&, processor = processors[static_cast<size_t>(thread) % processors.size()], thread] {
      stayOn(processor);
      run(thread);
    });
  pool.clear(); // joins
  return best;
}

// Lanes are added apart, or the sum would wait for itself.
float sumOf(const float* a, size_t count) {
  constexpr size_t kLanes = 64;
  float lanes[kLanes] = {};
  for (size_t i = 0; i + kLanes <= count; i += kLanes)
    for (size_t lane = 0; lane < kLanes; ++lane) lanes[lane] += a[i + lane];
  float sum = 0;
  for (const float lane : lanes) sum += lane;
  return sum;
}

// Arrays of one thread, walked through part by part.
struct Arrays {
  std::vector<float> a = std::vector<float>(kArrayFloats, 1.f), b = a, c = a;
  size_t part = 0;
};

using Kernel = void (*)(float* a, float* b, float* c, size_t count);
double streamBytesPerSecond(int threads, Kernel kernel, int arraysTouched) {
  return rateOf(threads, [=](int) -> Worker {
    return [=, arrays = std::make_shared<Arrays>()] {
      const size_t begin = arrays->part++ * kPartFloats % kArrayFloats;
      kernel(arrays->a.data() + begin, arrays->b.data() + begin, arrays->c.data() + begin, kPartFloats);
      return static_cast<double>(arraysTouched) * static_cast<double>(kPartFloats * sizeof(float));
    };
  });
}

// Chains of multiply-adds, as many as hide the latency of one and stay in 16 registers; kRounds of each a
// call. Written out for each instruction set: what is inlined into a function for one must be for that one
// too.
constexpr int kChains = 12, kRounds = 2048;

double sseChains() {
  __m128 sums[kChains];
  for (auto& sum : sums) sum = _mm_setzero_ps();
  __m128 factor = _mm_set1_ps(0.999f);
  use(factor);
  for (int round = 0; round < kRounds; ++round)
#pragma GCC unroll 12
    for (int chain = 0; chain < kChains; ++chain)
      sums[chain] = _mm_add_ps(_mm_mul_ps(sums[chain], factor), factor);
  use(sums);
  return 2.0 * 4 * kChains * kRounds;
}

__attribute__((target("avx2,fma"))) double avx2Chains() {
  __m256 sums[kChains];
  for (auto& sum : sums) sum = _mm256_setzero_ps();
  __m256 factor = _mm256_set1_ps(0.999f);
  use(factor);
  for (int round = 0; round < kRounds; ++round)
#pragma GCC unroll 12
    for (int chain = 0; chain < kChains; ++chain) sums[chain] = _mm256_fmadd_ps(sums[chain], factor, factor);
  use(sums);
  return 2.0 * 8 * kChains * kRounds;
}

__attribute__((target("avx512f"))) double avx512Chains() {
  __m512 sums[kChains];
  for (auto& sum : sums) sum = _mm512_setzero_ps();
  __m512 factor = _mm512_set1_ps(0.999f);
  use(factor);
  for (int round = 0; round < kRounds; ++round)
#pragma GCC unroll 12
    for (int chain = 0; chain < kChains; ++chain) sums[chain] = _mm512_fmadd_ps(sums[chain], factor, factor);
  use(sums);
  return 2.0 * 16 * kChains * kRounds;
}

__attribute__((target("avx512f,avx512bf16"))) double bf16Chains() {
  __m512 sums[kChains];
  for (auto& sum : sums) sum = _mm512_setzero_ps();
  __m512bh factor = _mm512_cvtne2ps_pbh(_mm512_set1_ps(1e-3f), _mm512_set1_ps(1e-3f));
  use(factor);
  for (int round = 0; round < kRounds; ++round)
#pragma GCC unroll 12
    for (int chain = 0; chain < kChains; ++chain) sums[chain] = _mm512_dpbf16_ps(sums[chain], factor, factor);
  use(sums);
  return 2.0 * 2 * 16 * kChains * kRounds;
}

double chainsPerSecond(int threads, double (*chains)()) {
  return rateOf(threads, [=](int) -> Worker { return chains; });
}

// A sequence that visits numbers in no order that a prefetcher could know.
uint64_t next(uint64_t& state) { // xorshift [Marsaglia 2003]
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return state;
}

class Descriptor {
public:
  Descriptor(const std::filesystem::path& file, int flags)
      : number_(::open(file.c_str(), O_RDONLY | flags)) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

private:
  int number_;
};

using PageAligned = std::unique_ptr<void, decltype(&std::free)>;

// Reads of 64 KiB at random places; 0 where one fails.
double randomReadBytesPerSecond(const std::filesystem::path& file, int flags, int threads) {
  const uint64_t blocks = std::filesystem::file_size(file) / kReadBytes;
  const Descriptor descriptor(file, flags);
  if (descriptor.number() < 0 || blocks < 16) return 0;
  std::atomic<bool> failed = false;
  const double rate = rateOf(threads, [&](int thread) -> Worker {
    const std::shared_ptr<void> buffer = PageAligned(std::aligned_alloc(4096, kReadBytes), std::free);
    return [&, buffer, state = uint64_t(thread + 1) * 0x9e3779b97f4a7c15u]() mutable {
      const auto offset = static_cast<off_t>(next(state) % blocks * kReadBytes);
      if (::pread(descriptor.number(), buffer.get(), kReadBytes, offset) != ssize_t(kReadBytes))
        failed = true;
      return static_cast<double>(kReadBytes);
    };
  });
  return failed ? 0 : rate;
}

// All threads can do what one can: where others keep them from it, one tells more.
template <class Measure> MachineLimits::OneAll onOneAndAll(const Measure& measure) {
  const double one = measure(1);
  return {one, std::max(one, measure(allThreads()))};
}

using MeasureIsa = std::optional<double> (*)(int);
std::optional<MachineLimits::OneAll> onOneAndAll(MeasureIsa measure) {
  const auto one = measure(1);
  if (!one) return std::nullopt;
  return MachineLimits::OneAll{*one, std::max(*one, *measure(allThreads()))};
}

// A file that is gone when nobody needs it any more.
class ScratchFile {
public:
  explicit ScratchFile(const std::filesystem::path& folder) : path_(folder / "machine.scratch") {
    const std::vector<std::byte> part(size_t{1} << 20, std::byte{1});
    AtomicFile file(path_);
    for (int i = 0; i < 256; ++i) file.write(part);
    file.commit();
  }
  ~ScratchFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

private:
  std::filesystem::path path_;
};

} // namespace

int allThreads() { return static_cast<int>(processorsOfProcess().size()); }

double readBytesPerSecond(int threads) {
  return streamBytesPerSecond(
      threads, [](float* a, float*, float*, size_t count) { use(sumOf(a, count)); }, 1);
}

double copyBytesPerSecond(int threads) {
  return streamBytesPerSecond(
      threads, [](float* a, float* b, float*, size_t count) { std::memcpy(b, a, count * sizeof(float)); }, 2);
}

double triadBytesPerSecond(int threads) {
  return streamBytesPerSecond(
      threads,
      [](float* a, float* b, float* c, size_t count) {
        for (size_t i = 0; i < count; ++i) a[i] = b[i] + 3.f * c[i];
      },
      3);
}

double randomLinesPerSecond(int threads) {
  constexpr size_t kLine = 64, kLines = (size_t{256} << 20) / kLine, kVisits = size_t{1} << 14;
  return rateOf(threads, [](int thread) -> Worker {
    const auto bytes = std::make_shared<std::vector<uint8_t>>(kLines * kLine, uint8_t{1});
    return [bytes, state = uint64_t(thread + 1) * 0x9e3779b97f4a7c15u]() mutable {
      uint64_t sum = 0;
      for (size_t visit = 0; visit < kVisits; ++visit) sum += (*bytes)[next(state) % kLines * kLine];
      use(sum);
      return static_cast<double>(kVisits);
    };
  });
}

double sseFlopsPerSecond(int threads) { return chainsPerSecond(threads, sseChains); }

std::optional<double> avx2FlopsPerSecond(int threads) {
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return std::nullopt;
  return chainsPerSecond(threads, avx2Chains);
}

std::optional<double> avx512FlopsPerSecond(int threads) {
  if (!__builtin_cpu_supports("avx512f")) return std::nullopt;
  return chainsPerSecond(threads, avx512Chains);
}

std::optional<double> bf16FlopsPerSecond(int threads) {
  if (!__builtin_cpu_supports("avx512bf16")) return std::nullopt;
  return chainsPerSecond(threads, bf16Chains);
}

double cachedReadBytesPerSecond(const std::filesystem::path& file, int threads) {
  readFile(file); // now the page cache holds it
  const double rate = randomReadBytesPerSecond(file, 0, threads);
  if (!(rate > 0)) throw Error("cannot be read at random places").in(file);
  return rate;
}

std::optional<double> directReadBytesPerSecond(const std::filesystem::path& file) {
  const double rate = randomReadBytesPerSecond(file, O_DIRECT, kQueueDepth);
  if (!(rate > 0)) return std::nullopt;
  return rate;
}

double MachineLimits::bytesPerSecond() const { return std::max({read.all, copy.all, triad.all}); }

double MachineLimits::flopsPerSecond() const {
  return std::max({sse.all, avx2 ? avx2->all : 0, avx512 ? avx512->all : 0});
}

MachineLimits measureMachine(const std::filesystem::path& scratchFolder) {
  MachineLimits limits;
  limits.threads = allThreads();
  limits.read = onOneAndAll(readBytesPerSecond);
  limits.copy = onOneAndAll(copyBytesPerSecond);
  limits.triad = onOneAndAll(triadBytesPerSecond);
  limits.randomLines = onOneAndAll(randomLinesPerSecond);
  limits.sse = onOneAndAll(sseFlopsPerSecond);
  limits.avx2 = onOneAndAll(avx2FlopsPerSecond);
  limits.avx512 = onOneAndAll(avx512FlopsPerSecond);
  limits.bf16 = onOneAndAll(bf16FlopsPerSecond);
  const ScratchFile scratch(scratchFolder);
  limits.cachedRead =
      onOneAndAll([&](int threads) { return cachedReadBytesPerSecond(scratch.path(), threads); });
  limits.directRead = directReadBytesPerSecond(scratch.path());
  return limits;
}

} // namespace surflect::bench
