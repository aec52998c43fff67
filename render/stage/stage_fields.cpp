#include "render/stage/stage_fields.h"

#include <fmt/format.h>

namespace surflect {

double numberIn(const Entry& entry, double least, double most) {
  const double number = asNumber(entry);
  if (!(number >= least && number <= most)) throw mismatch(entry, fmt::format("{} to {}", least, most));
  return number;
}

double positive(const Entry& entry) {
  const double number = asNumber(entry);
  if (!(number >= 1e-9 && number <= 1e9)) throw mismatch(entry, "a number above 0, in 1e-9..1e9");
  return number;
}

int integerOr(const Section& section, std::string_view key, int least, int most, int otherwise) {
  const auto entry = section.find(key);
  return entry ? asInteger(*entry, least, most) : otherwise;
}

Vec3<double> asVector(const Entry& entry) {
  const auto parts = asArray(entry, "an array of 3 numbers");
  if (parts.size() != 3) throw mismatch(entry, "an array of 3 numbers");
  return {numberIn(parts[0], -1e9, 1e9), numberIn(parts[1], -1e9, 1e9), numberIn(parts[2], -1e9, 1e9)};
}

Point3<AcquisitionSpace, double> pointOr0(const Section& section, std::string_view key) {
  const auto entry = section.find(key);
  return assume<Point3<AcquisitionSpace, double>>(entry ? asVector(*entry) : Vec3<double>(0, 0, 0));
}

Rgb asColor(const Entry& entry, double least, double most) {
  const auto parts = asArray(entry, "an array of 3 numbers");
  if (parts.size() != 3) throw mismatch(entry, "an array of 3 numbers");
  const auto channel = [&](size_t i) { return static_cast<float>(numberIn(parts[i], least, most)); };
  return {channel(0), channel(1), channel(2)};
}

} // namespace surflect
