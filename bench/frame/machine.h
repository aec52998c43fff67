// Benchmarks of the machine's limits, the yardstick of a frame's stages. [McCalpin 1995] Memory Bandwidth and
// Machine Balance in Current High Performance Computers (STREAM): bytes are those that the program names.
#pragma once

namespace surflect::bench {

// Registers, each on all threads,
//   machine/read, machine/triad  bytes_per_second: floats summed; a = b + 3 c; over 64 MiB an array and
//   thread machine/multiply-add         flops: in registers, two operations each
void registerMachine();

} // namespace surflect::bench
