// Compresses light field maps: smaller view maps, then codebooks, then S3TC.  [Chen 2002, §4]
#pragma once

#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/vector_quantization.h"
#include "render/method/method.h"
#include "render/method/option.h"
#include "surfel/base/time.h"

#include <optional>

namespace surflect::lfm {

struct Compression {
  std::optional<double> ratio; // vector quantisation: maps for each codeword
  std::optional<double> error; // vector quantisation: RMS error of values within -1..1 that suffices
  std::optional<CodebookStart> start;
  bool means = false; // whether mean maps get a codebook, too
  bool s3tc = false;
  std::optional<int> higherViewSize; // cells along a side of view maps from the second term on

  bool isAsked() const { return hasCodebooks() || s3tc || higherViewSize; }
  bool hasCodebooks() const { return ratio || error; }
};

// Throws Error if view maps have fewer cells along a side than are asked for from the second term on.
void requireViewSize(const Compression& compression, int viewSize);

// Throws Error if more maps are to share a codeword than there are view maps, one for each vertex of the
// mesh.
void requireRatio(const Compression& compression, const TriangleMesh& mesh);

// Throws Error as requireRatio, for maps that have codebooks, if others are asked for, or S3TC blocks
// already; and Cancelled.
LightFieldMaps compressed(LightFieldMaps maps, const Compression& compression, const Progress& progress = {});

// Bytes of maps by kind, as counts of a report: "map_bytes.surface".
void addMapBytes(const MapBytes& bytes, method::BuildReport& report);
// Likewise sizes of finished maps that were compressed, which are told to people, too.
void addCompressed(const LightFieldMaps& maps, const method::BuildInput& input, method::BuildReport& report);

// Throws Error if a build from finished maps, the source, would leave them as they are, or replace them.
void requireCompression(const method::BuildInput& input, const Compression& compression);

} // namespace surflect::lfm
