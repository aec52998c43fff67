// A first look at the photographs of a few views, before any is encoded.
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

struct PackSurvey {
  double white = 1; // what errors and floors of the store are measured against
  LightBlendSelection lights;
};

// Up to eight views, evenly chosen, tell the white level, which is the 99.5th percentile of the object's
// radiance over all channels, and how lights are blended where cameras and lights are chosen apart. `frames`
// of each view, as indices into source.training().frames; `mesh` is the one that `impostor` casts rays at,
// and `normals` says what it was made of. Throws Error where no photograph shows anything, and Cancelled.
PackSurvey surveyCapture(PackSource& source, std::span<const std::vector<size_t>> frames,
                         const TriangleMesh& mesh, NormalsFrom normals,
                         const RayCaster<AcquisitionSpace>& impostor, const Progress& progress);

// The survey as pack keeps it, so that who resumes need not look at those views again.
std::string packSurveyText(const PackSurvey& survey);
// Of another form than packSurveyText's, it is none.
std::optional<PackSurvey> parsePackSurvey(const std::string& text);

} // namespace surflect::model
