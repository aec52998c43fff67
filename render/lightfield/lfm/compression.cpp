#include "render/lightfield/lfm/compression.h"

#include "render/lightfield/common/views.h"
#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/quantization.h"
#include "render/lightfield/lfm/tile.h"
#include "render/lightfield/lfm/vertex_matrix.h"
#include "render/lightfield/lfm/view_blend.h"
#include "surfel/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

namespace surflect::lfm {

namespace {

bool hasBlocks(const LightFieldMaps& maps) {
  const auto isEncoded = [](const MapTable& table) { return table.maps.coding != Coding::bytes; };
  return isEncoded(maps.mean) || std::ranges::any_of(maps.terms, [&](const Term& term) {
           return isEncoded(term.surface) || isEncoded(term.view);
         });
}

} // namespace

void requireRatio(const Compression& compression, const TriangleMesh& mesh) {
  const size_t vertices = mesh.positions.size();
  if (compression.ratio && *compression.ratio > static_cast<double>(vertices))
    throw Error::mismatch(fmt::format("{} view maps at most, one for each vertex", vertices),
                          fmt::format("{:.10g} for each codeword", *compression.ratio))
        .at("--vq");
}

void requireViewSize(const Compression& compression, int viewSize) {
  if (compression.higherViewSize && *compression.higherViewSize > viewSize)
    throw Error::mismatch(fmt::format("at most {}, as many as the view maps have", viewSize),
                          std::to_string(*compression.higherViewSize))
        .at("--higher-view-size");
}

LightFieldMaps compressed(LightFieldMaps maps, const Compression& compression, const Progress& progress) {
  requireRatio(compression, maps.mesh);
  if (compression.isAsked() && hasBlocks(maps))
    throw Error("have S3TC blocks already, expected bytes").at("maps");
  if ((compression.higherViewSize || compression.hasCodebooks()) && maps.layout != SurfaceLayout::packed)
    throw Error("have codebooks already").at("maps");
  requireViewSize(compression, maps.higherViewSize);
  if (compression.higherViewSize)
    maps = withHigherViewSize(std::move(maps), *compression.higherViewSize, progress);
  if (compression.hasCodebooks()) {
    const double error = compression.error.value_or(0);
    maps = withCodebooks(maps,
                         {.start = compression.start.value_or(CodebookStart::split),
                          .ratio = compression.ratio.value_or(0),
                          .distortion = error * error,
                          .means = compression.means},
                         progress);
  }
  if (compression.s3tc) maps = encoded(std::move(maps));
  return maps;
}

void addMapBytes(const MapBytes& bytes, method::BuildReport& report) {
  const std::pair<const char*, size_t> kinds[] = {{"surface", bytes.surface}, {"view", bytes.view},
                                                  {"mean", bytes.mean},       {"indices", bytes.indices},
                                                  {"scales", bytes.scales},   {"all", bytes.total()}};
  for (const auto& [kind, size] : kinds)
    report.counts[std::string("map_bytes.") + kind] = static_cast<double>(size);
}

void addCompressed(const LightFieldMaps& maps, const method::BuildInput& input, method::BuildReport& report) {
  const size_t triangles = maps.mesh.triangles.size();
  const uint64_t resampled = resampledBytes(triangles, PatchGrid::samples(maps.samples),
                                            ViewGrid(maps.viewSize).cells(), maps.channels);
  const size_t bytes = bytesOf(maps).total();
  input.say(fmt::format("{}: maps of {}, {:.0f} times smaller than the resampled light field",
                        input.output.string(), lightfield::mebibytes(bytes),
                        lightfield::ratioOf(resampled, bytes)));
  report.counts["triangles"] = static_cast<double>(triangles);
  report.counts["samples"] = maps.samples;
  report.counts["resampled_bytes"] = static_cast<double>(resampled);
  report.counts["compression"] = lightfield::ratioOf(resampled, bytes);
  report.counts["bytes"] = static_cast<double>(method::modelBytes(input.output));
  addMapBytes(bytesOf(maps), report);
}

void requireCompression(const method::BuildInput& input, const Compression& compression) {
  if (!compression.isAsked())
    throw Error("is finished: --vq, --s3tc or --higher-view-size would compress it").in(input.source);
  std::error_code unknown; // reported when writing
  if (std::filesystem::equivalent(input.source, input.output, unknown))
    throw Error("is the source: give another -o").in(input.output);
}

} // namespace surflect::lfm
