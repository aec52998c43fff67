// What a frame's look-ups cost in one order or another while their blocks come from the disk.
// [Weyrich 2005, §5.3] sorts them and gains an order of magnitude.
#pragma once

#include "bench/doll/frame_times.h"

#include <span>
#include <string>
#include <vector>

namespace surflect::bench {

// An operation is a surfel and a view, with all its lights.
struct OrderCost {
  std::string order;
  size_t images = 0;     // that the cache holds; an image is all of a view under all lights
  size_t operations = 0; // that were measured
  double seconds = 0;    // each operation
  double reads = 0;      // blocks, each operation
};

// For caches of these sizes, on one thread, the model's files forgotten by the system before each order. Of
// orders that answer one operation after the other, only some are measured, which meet as many blocks anew as
// all would: shuffled surfels any of them, surfels along the cloud's curve some stretches of it.
std::vector<OrderCost> costOfOrders(const model::Model& model, const Shot& shot,
                                    std::span<const size_t> images);

} // namespace surflect::bench
