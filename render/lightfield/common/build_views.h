// Input of a builder, and the parts of its report that all builders share.
#pragma once

#include "render/lightfield/common/views.h"
#include "render/method/method.h"

#include <cstdint>
#include <string>

namespace surflect::lightfield {

// Views of a build's source, after the output folder has been found fit; says how capture and mesh were
// understood. Throws Error as requireLightFieldFolder() and Views do.
Views viewsOf(const method::BuildInput& input, const Progress& progress, bool plainPinholes = false);

// "1.5 MiB"
std::string mebibytes(uint64_t bytes);
// Bytes of the training views' pictures.
uint64_t pictureBytes(const Views& views);
// `whole` / `part`; 0 if `part` is 0.
double ratioOf(uint64_t whole, uint64_t part);

} // namespace surflect::lightfield
