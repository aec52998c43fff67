// The folder of a model while pack writes it: what earlier runs left there, and what of it is kept.
#pragma once

#include "srf/codec/view_encoder.h"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace surflect::model {

// views/identity: what the files of an earlier run were made of.
std::filesystem::path packIdentityPath();
// views/survey: see packSurveyText().
std::filesystem::path surveyPath();

// A manifest is written last and makes a model finished.
bool isFinished(const std::filesystem::path& folder);
// pack has begun to write there and has not come to the manifest.
bool isUnfinished(const std::filesystem::path& folder);

// Throws Error where there is a finished model of another identity: it is not replaced by mistake.
void protectFinished(const std::filesystem::path& folder, const std::string& identity);

// Only a new folder, or one that pack has begun or made, may be written into: a capture has files of the same
// names. Throws Error. What a run left that was killed while it wrote is removed.
void claimPackFolder(const std::filesystem::path& folder);

// Writes the file of a view, and beside it what encoding lost: nothing else knows it once the photographs are
// gone.
void writeView(const std::filesystem::path& folder, size_t view, const codec::EncodedView& encoded);
// What a view file of an earlier run holds and lost, where it is complete.
std::optional<codec::ViewSummary> finishedView(const std::filesystem::path& folder, size_t view);

// All views, and the survey.
void removeViews(const std::filesystem::path& folder);

} // namespace surflect::model
