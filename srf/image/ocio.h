// Views of OpenColorIO: how a studio's configuration shows the light of a scene on its displays.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace surflect::image {

struct ForeignView;

class OcioView {
public:
  // A view of a display in the configuration that $OCIO names; empty names mean those it prefers. Colours are
  // taken to be in its space of linear Rec. 709, if it has one by a usual name, else in its role
  // scene_linear. Throws Error at "tone", "ocio_display" or "ocio_view": for a missing or damaged
  // configuration, and names that it lacks.
  OcioView(const std::string& display, const std::string& view);

  const std::string& display() const;
  const std::string& view() const;

  // Colours of the display, as encoded for it and not clipped, from linear ones; RGB, in place. Thread-safe.
  void apply(std::span<float> rgb) const;

  // Hash of the transform's answers to a lattice of colours: configurations that show alike are alike.
  uint64_t hash() const;

private:
  std::shared_ptr<const ForeignView> opened_;
};

} // namespace surflect::image
