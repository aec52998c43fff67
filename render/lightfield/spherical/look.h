// Options of a picture of a spherical light field.
#pragma once

namespace surflect::spherical {

// Level of detail of a picture, and how its rays are looked up.
struct Look {
  double detail = 0;        // continuous level of detail, 0..levels-1
  double mip = 0;           // least mip level of the images
  bool depth = true;        // rays meet the heights of an image rather than its plane
  bool interpolated = true; // between neighbouring pencils
  friend bool operator==(const Look&, const Look&) = default;
};

} // namespace surflect::spherical
