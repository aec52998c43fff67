#include "render/stage/stage_fields.h"

namespace surflect::stage {

double positive(const scene::Entry& entry) {
  const double number = scene::asNumber(entry);
  if (!(number >= 1e-9 && number <= 1e9)) throw scene::mismatch(entry, "a number above 0, in 1e-9..1e9");
  return number;
}

int integerOr(const scene::Section& section, std::string_view key, int least, int most, int otherwise) {
  const auto entry = section.find(key);
  return entry ? scene::asInteger(*entry, least, most) : otherwise;
}

Point3<AcquisitionSpace, double> pointOr0(const scene::Section& section, std::string_view key) {
  const auto entry = section.find(key);
  return assume<Point3<AcquisitionSpace, double>>(entry ? asVector(*entry) : Vec3<double>(0, 0, 0));
}

Rgb asColor(const scene::Entry& entry, double least, double most) {
  const auto parts = scene::asArray(entry, "an array of 3 numbers");
  if (parts.size() != 3) throw scene::mismatch(entry, "an array of 3 numbers");
  const auto channel = [&](size_t i) { return static_cast<float>(numberIn(parts[i], least, most)); };
  return {channel(0), channel(1), channel(2)};
}

} // namespace surflect::stage
