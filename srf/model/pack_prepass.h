// Survey of a few views before encoding: white level, light blend, and whether alpha matters.
#pragma once

#include "srf/capture/photograph.h"
#include "srf/codec/view_encoder.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "srf/model/pack_source.h"
#include "srf/model/weights_selection.h"
#include "surfel/base/time.h"
#include "surfel/geometry/ray_caster.h"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::model {

// Pictures of a view with its object mask.
struct MattedView {
  codec::ReflectanceStack stack;
  image::Mask object;
  size_t invalidTexels = 0; // as in ViewPictures
};

// Fills a missing matte from the silhouette of the impostor. Inside the silhouette's rim, where an impostor
// off by a pixel or two would show background, colours are continued from further inside.
MattedView fillMissingMatte(ViewPictures pictures, const capture::Camera<AcquisitionSpace>& camera,
                            const RayCaster<AcquisitionSpace>& impostor);

// Pictures of the only view of a model with a pixel grid; without a matte, the whole picture is the object.
MattedView wholeView(ViewPictures pictures);

// Tells whether alpha shows a translucent object, or only the edges of an opaque one.

// Least share of translucent pixels in a translucent object.
inline constexpr double kTranslucentShare = 0.05;

// Counts pixels with alpha above 0, and the translucent ones among them. Alpha between 0 and 1 is translucent
// unless opaque and clear pixels both lie within two pixels: those are edges that a pixel or a blur has
// averaged.
class TranslucencySurvey {
public:
  // alpha: 1 channel.
  void add(const image::Image& alpha);

  double share() const;
  bool isTranslucent() const { return share() >= kTranslucentShare; }

private:
  size_t object_ = 0, translucent_ = 0;
};

// White level of the photographs of an object.

// Accumulates the 99.5th percentile of the object's radiance over all channels.
class WhiteLevel {
public:
  void add(const codec::ReflectanceStack& stack, const image::Mask& object, const Progress& progress = {});

  bool isKnown() const { return values_.count() > 0; } // true once an object texel was added
  double value() const;                                // within 1e-20..1e20

private:
  image::PercentileCounter values_;
};

struct PackPrepass {
  double white = 1; // white level, which scales error bounds
  LightBlendSelection lights;
  bool isTranslucent = false; // alpha is more than a mask; see TranslucencySurvey
};

// Surveys up to eight evenly chosen views. The white level is the 99.5th percentile of the object's radiance
// over all channels; the light blend is selected if every view has every light. `frames` are indices into
// source.training().frames, by view; `impostor` casts rays at `mesh`; `normals` says how the mesh's normals
// were found. `part`: for a model with a pixel grid, how its view is read. Throws Error if no photograph
// shows the object, and Cancelled.
PackPrepass prepass(PackSource& source, std::span<const std::vector<size_t>> frames, const TriangleMesh& mesh,
                    NormalsFrom normals, const RayCaster<AcquisitionSpace>& impostor,
                    const std::optional<capture::ViewPart>& part, const Progress& progress);

// Text form of a survey, which pack keeps so that a resumed run need not repeat it.
std::string packPrepassText(const PackPrepass& survey);
// Parses a packPrepassText; empty if the text has another form.
std::optional<PackPrepass> parsePackPrepass(const std::string& text);

} // namespace surflect::model
