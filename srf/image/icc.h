// ICC profiles of pictures, applied by Little CMS.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace surflect::image {

// Transform from a profile's colours to linear Rec. 709: relative colorimetric, without black point
// compensation. The profile's white becomes white; colours outside of Rec. 709's gamut have negative values.
// Thread-safe.
class IccTransform {
public:
  // Throws Error if the profile is damaged or has another number of colour channels (1 grey, 3 RGB).
  IccTransform(std::string_view profile, int channels);

  const std::string& name() const { return name_; } // "Display P3"; printable ASCII
  int channels() const { return channels_; }
  // Converts `pixels` pixels of stored values in 0..1 to RGB; grey becomes RGB too.
  void toRec709(const float* stored, float* rgb, size_t pixels) const;

private:
  struct Transform;
  int channels_;
  std::string name_;
  std::shared_ptr<const Transform> transform_;
};

} // namespace surflect::image
