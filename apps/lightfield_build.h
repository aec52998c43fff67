// Parts that the builders of all kinds of light fields share.
#pragma once

#include "apps/capture_argument.h"
#include "apps/command.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/olf/visible_views.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace surflect {

struct BuildArguments {
  CaptureArgument views;
  std::string mesh, output;

  // Reads the views. Throws Error for an output folder that may not be a light field's and, with
  // `plainPinholes`, for lenses that are not undistorted pinholes.
  lightfield::Views read(const Progress& progress, bool plainPinholes = false) const;
};

void addBuildArguments(CLI::App& command, BuildArguments& arguments);

// --hull and --triangles of a coarse mesh around the object.
void addCoarseMesh(CLI::App& command, bool& hull, size_t& triangles);
// --visible of opacity light fields.
void addVisible(CLI::App& command, std::optional<olf::Visible>& visible);
// --samples and --view-size of light field maps.
void addMapSizes(CLI::App& command, int& samples, int& viewSize);

// Prints how capture and mesh were understood.
void sayNotes(const lightfield::Views& views);

std::string mebibytes(uint64_t bytes);

// Bytes of the training views' pictures.
uint64_t pictureBytes(const lightfield::Views& views);
// `whole` / `part`; 0 if `part` is 0.
double ratioOf(uint64_t whole, size_t part);
// Bytes of light field maps, for --json.
Json mapBytesJson(const lfm::MapBytes& bytes);

// `lightfield build lfm`.
void addLightFieldMaps(CLI::App& build, CommandWork& work);
// `lightfield build vdtm` and `lightfield build ulr`.
void addOpacityLightFields(CLI::App& build, CommandWork& work);
// `lightfield build olfm`.
void addOpacityLightFieldMaps(CLI::App& build, CommandWork& work);
// `lightfield build spherical`.
void addSphericalLightField(CLI::App& build, CommandWork& work);

} // namespace surflect
