#include "render/lightfield/common/build_views.h"

#include "render/lightfield/common/light_field_folder.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <system_error>

namespace surflect::lightfield {

Views viewsOf(const method::BuildInput& input, const Progress& progress, bool plainPinholes) {
  requireCreatable(input.output);
  requireLightFieldFolder(input.output);
  Views views(input.source, {.mesh = input.mesh, .paths = input.paths, .plainPinholes = plainPinholes},
              progress);
  for (const std::string& note : views.capture().notes) input.say(note);
  for (const std::string& note : views.geometry().notes) input.say(note);
  return views;
}

std::string mebibytes(uint64_t bytes) {
  return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / (1 << 20));
}

uint64_t pictureBytes(const Views& views) {
  uint64_t bytes = 0;
  for (const size_t view : views.ofSplit(capture::Split::train)) {
    std::error_code failure;
    const uint64_t size = std::filesystem::file_size(views.picture(view), failure);
    if (!failure) bytes += size;
  }
  return bytes;
}

double ratioOf(uint64_t whole, uint64_t part) {
  return part > 0 ? static_cast<double>(whole) / static_cast<double>(part) : 0;
}

} // namespace surflect::lightfield
