// The model folder while pack writes it: detects, protects, resumes and removes files of earlier runs.
#pragma once

#include "srf/codec/alpha_plane.h"
#include "srf/codec/view_encoder.h"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

namespace surflect::model {

// views/identity: the packIdentity of the run that wrote the files.
std::filesystem::path packIdentityPath();
// views/survey: a packPrepassText.
std::filesystem::path surveyPath();

// Returns true if the folder has a manifest, which is written last.
bool isFinished(const std::filesystem::path& folder);
// Returns true if pack has begun to write but has not written the manifest.
bool isUnfinished(const std::filesystem::path& folder);

// Throws Error if the folder holds a finished model of another identity.
void protectFinished(const std::filesystem::path& folder, const std::string& identity);

// Creates or takes over a folder for pack, and removes temporary files of a killed run. Throws Error unless
// the folder is new, empty, or was begun or made by pack, since a capture has files of the same names.
void claimPackFolder(const std::filesystem::path& folder);

// Writes the alpha file of a view. To be called before writeView, which marks the view as finished.
void writeAlpha(const std::filesystem::path& folder, size_t view, const codec::AlphaPlane& plane);
// Writes a view file, and beside it its summary, which cannot be recomputed without the photographs.
void writeView(const std::filesystem::path& folder, size_t view, const codec::EncodedView& encoded);
// Writes the summary of a view file that is there already.
void writeSummary(const std::filesystem::path& folder, size_t view, const codec::ViewSummary& summary);
// Summary of a view file of an earlier run; empty unless file and summary are complete.
std::optional<codec::ViewSummary> finishedView(const std::filesystem::path& folder, size_t view);
// Returns whether an earlier run has written the alpha file of a view of this size.
bool isAlphaFinished(const std::filesystem::path& folder, size_t view, int width, int height);

// Removes all views and the survey.
void removeViews(const std::filesystem::path& folder);

} // namespace surflect::model
