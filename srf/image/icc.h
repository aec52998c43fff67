// ICC profiles, by Little CMS: what a device's colours are, as pictures carry it in themselves.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace surflect::image {

// From a profile's colours to linear light of Rec. 709: relative colorimetric, without black point
// compensation, so the profile's white becomes white, and colours out of Rec. 709's gamut have negative
// values. One transform serves several threads.
class IccTransform {
public:
  // Throws Error where the profile is damaged, or not of so many colour channels: 1 gray, 3 RGB.
  IccTransform(std::string_view profile, int channels);

  const std::string& name() const { return name_; } // "Display P3"; printable ASCII
  int channels() const { return channels_; }
  // Gray, too, becomes RGB. Values of the profile are in 0..1.
  void toRec709(const float* stored, float* rgb, size_t pixels) const;

private:
  struct Transform;
  int channels_;
  std::string name_;
  std::shared_ptr<const Transform> transform_;
};

} // namespace surflect::image
