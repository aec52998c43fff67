#include "srf/validation/validation.h"

#include "srf/capture/mask_survey.h"

namespace surflect::validation {

std::vector<Finding> checkMattes(const capture::Capture& capture, const CheckEffort& effort,
                                 const Progress& progress) {
  std::vector<Finding> findings;
  for (std::string& warning : capture::surveyMasks(capture, false, progress, effort.views).warnings)
    findings.push_back({Finding::Severity::warning, std::move(warning)});
  return findings;
}

} // namespace surflect::validation
