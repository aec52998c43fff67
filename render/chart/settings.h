// Settings that a chart tries.
#pragma once

#include "render/method/option.h"

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace surflect::chart {

// The setting without knobs that have their most accurate value, so that equal settings compare equal.
method::Setting withoutFull(std::span<const method::Option> knobs, method::Setting setting);

// Every combination of the knobs' values; each setting names every knob.
std::vector<method::Setting> combinations(std::span<const method::Option> knobs);

// Every value of every knob while the others have their most accurate values. The first setting has all knobs
// at their most accurate values.
std::vector<method::Setting> oneByOne(std::span<const method::Option> knobs);

struct Cost {
  double work = 0;  // of a frame, in any unit
  double error = 0; // against the most accurate setting
};
// Greedy descent from the most accurate setting. Each step moves one knob to its next value: the knob that
// saves most work for the error that it adds. Ends when no step saves 2 % of the work, or after `most` steps.
// Returns the settings that it passes, without the first. `cost` is called once for each setting that is
// compared.
std::vector<method::Setting> descent(std::span<const method::Option> knobs, size_t most,
                                     const std::function<Cost(const method::Setting&)>& cost);

// The largest number of steps that descent() can take.
size_t longestDescent(std::span<const method::Option> knobs, size_t most);

} // namespace surflect::chart
