// Benchmarks of the machine's limits, for comparison with a frame's stages. Bytes count those named in the
// code [McCalpin 1995, Memory Bandwidth and Machine Balance in Current High Performance Computers (STREAM)].
#pragma once

namespace surflect::bench {

// Registers the following benchmarks, each on all threads:
//   machine/read, machine/triad  bytes_per_second: sum of floats; a = b + 3 c; 64 MiB an array and thread
//   machine/multiply-add         flops: in registers, two operations each
void registerMachine();

} // namespace surflect::bench
