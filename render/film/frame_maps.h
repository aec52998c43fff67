// The maps of a shot's frames: the layers that they are made of, and how they are rendered.
#pragma once

#include "render/film/maps.h"
#include "render/film/shot_renderer.h"

#include <optional>
#include <string>
#include <vector>

namespace surflect::film {

// Maps show the object sharp, also where its frame is blurred: such a frame has layers of its own for them.
class FrameMaps {
public:
  // Throws Error for a map of the script that frames of the model cannot give. The script must have an
  // output, and outlive the object.
  FrameMaps(const scene::Script& script, const method::Description& model);

  // AOVs to render a frame with: those that the script asks for, and those of which its maps are made.
  const std::vector<std::string>& aovs(const ShotRenderer& shot, int frame) const;

  struct Made {
    std::vector<image::PngSamples> maps; // one for each of the script's
    std::optional<double> beyond;        // of the heights that are clipped, the one farthest from the middle
  };
  // Makes the maps of a frame. Leaves only those layers in the frame that the script asks for.
  Made make(ShotRenderer& shot, int frame, double scale, method::FrameLayers& layers) const;

  // Heights of black and white, counted from the middle of the model's box.
  const HeightRange& heights() const { return range_; }

private:
  const scene::Output& output_;
  std::vector<std::string> layers_;   // of which the maps are made
  std::vector<std::string> rendered_; // those, and those that the script asks for
  HeightRange range_;
};

} // namespace surflect::film
