// Survey of a few views before encoding: white level, light blend, and whether alpha matters.
#pragma once

#include "srf/model/light_blend_selection.h"
#include "srf/model/pack_source.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/ray_caster.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::model {

struct PackPrepass {
  double white = 1; // white level, which scales error bounds
  LightBlendSelection lights;
  bool isTranslucent = false; // alpha is more than a mask; see TranslucencySurvey
};

// Surveys up to eight evenly chosen views. The white level is the 99.5th percentile of the object's radiance
// over all channels; the light blend is selected if every view has every light. `frames` are indices into
// source.training().frames, by view; `impostor` casts rays at `mesh`; `normals` says how the mesh's normals
// were found. Throws Error if no photograph shows the object, and Cancelled.
PackPrepass prepass(PackSource& source, std::span<const std::vector<size_t>> frames, const TriangleMesh& mesh,
                    NormalsFrom normals, const RayCaster<AcquisitionSpace>& impostor,
                    const Progress& progress);

// Text form of a survey, which pack keeps so that a resumed run need not repeat it.
std::string packPrepassText(const PackPrepass& survey);
// Parses a packPrepassText; empty if the text has another form.
std::optional<PackPrepass> parsePackPrepass(const std::string& text);

} // namespace surflect::model
