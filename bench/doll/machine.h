// What this machine can do at all, measured: the yardstick of every stage of a frame.
//
// Each figure is the best of a few short runs, on `threads` threads at once, so that what others do on the
// machine meanwhile counts as little as may be. [McCalpin 1995] Memory Bandwidth and Machine Balance in
// Current High Performance Computers (STREAM): bytes are those that the program names, not those that a cache
// fetches besides.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

namespace surflect::bench {

// The processors that this process may use.
int allThreads();

// Over arrays of 64 MiB for each thread, floats: sum of a; b = a; a = b + 3 c.
double readBytesPerSecond(int threads);
double copyBytesPerSecond(int threads);
double triadBytesPerSecond(int threads);

// Lines of 64 bytes from random places of 256 MiB, none of which waits for another.
double randomLinesPerSecond(int threads);

// Multiply-adds in registers, each two operations; empty where the processor has no such instructions.
double sseFlopsPerSecond(int threads);                   // multiply, then add: 4 lanes
std::optional<double> avx2FlopsPerSecond(int threads);   // vfmadd, 8 lanes
std::optional<double> avx512FlopsPerSecond(int threads); // vfmadd, 16 lanes
std::optional<double> bf16FlopsPerSecond(int threads);   // vdpbf16ps, 16 lanes of two products

// Random reads of 64 KiB from a file of at least 1 MiB that the page cache holds, on `threads` threads.
double cachedReadBytesPerSecond(const std::filesystem::path& file, int threads);
// The same past the page cache (O_DIRECT), 32 reads at a time; empty where the file system refuses.
std::optional<double> directReadBytesPerSecond(const std::filesystem::path& file);

struct MachineLimits {
  int threads = 1;
  // On one thread, and on all.
  struct OneAll {
    double one = 0, all = 0;
  };
  OneAll read, copy, triad; // bytes a second
  OneAll randomLines;       // a second
  OneAll sse;               // operations a second, like the next three
  std::optional<OneAll> avx2, avx512, bf16;
  OneAll cachedRead;                // bytes a second
  std::optional<double> directRead; // bytes a second

  // The most that all threads have reached in any way.
  double bytesPerSecond() const;
  double flopsPerSecond() const; // of 32 bits
};

// All of the above, in a few seconds. Writes a file of 256 MiB into the folder, which must be there, for as
// long as it measures reads. Throws Error.
MachineLimits measureMachine(const std::filesystem::path& scratchFolder);

} // namespace surflect::bench
