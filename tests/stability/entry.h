// Entry of the failure atlas: an input at which a method fails, and one figure of it for the naive form and
// for ours. The program `stability` tests all entries and writes the tables of docs/results/stability.md.
#pragma once

#include "srf/image/image.h"

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace surflect::stability {

struct Measured {
  double naive = 0, ours = 0; // not finite: the method has no answer there
};

struct Entry {
  std::string input, expected, figure; // the figure is an error: the less, the better
  double bound;                        // of ours
  std::function<Measured()> measure;
  std::string naive = {}; // the naive form, where it is not that of the group
};

// Pictures of an entry: RGBA, premultiplied.
struct Pictures {
  image::Image naive, ours, truth;
};

struct Illustration {
  std::string name; // of its files
  std::function<Pictures()> draw;
};

struct Group {
  std::string name, naive; // the naive form of its entries
  std::vector<Entry> entries;
  std::vector<Illustration> illustrations = {};
};

Group lookUpGroup();
Group ulrGroup();
Group krigingGroup();
Group lightGroup();
Group codecGroup();
Group splatGroup();
Group environmentGroup();
Group lightFieldGroup();
Group extrapolationGroup();
Group sharedGroup();

inline constexpr double kNoAnswer = std::numeric_limits<double>::quiet_NaN();

// The larger of both; a value that is not a number stays.
inline void raise(double& largest, double value) {
  if (!(value <= largest)) largest = std::isnan(largest) ? largest : value;
}

} // namespace surflect::stability
