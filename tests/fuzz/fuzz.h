// Shared part of the fuzz targets. A target is a file NAME_fuzz.cpp that defines fuzz_NAME(), a line here and
// one in CMakeLists.txt, and seeds: small files in seeds/NAME/, or made by tests/support/write_seeds.cpp.
#pragma once

#include <filesystem>
#include <string_view>

#define SURFLECT_FUZZ_TARGETS(DO)                                                                            \
  DO(block)                                                                                                  \
  DO(camera_path)                                                                                            \
  DO(capture)                                                                                                \
  DO(colmap)                                                                                                 \
  DO(environment)                                                                                            \
  DO(expression)                                                                                             \
  DO(exr)                                                                                                    \
  DO(fades)                                                                                                  \
  DO(foreign)                                                                                                \
  DO(gltf)                                                                                                   \
  DO(levels)                                                                                                 \
  DO(light_field_maps)                                                                                       \
  DO(lights)                                                                                                 \
  DO(lit_view)                                                                                               \
  DO(manifest)                                                                                               \
  DO(mesh_sequence)                                                                                          \
  DO(metashape)                                                                                              \
  DO(middlebury)                                                                                             \
  DO(obj)                                                                                                    \
  DO(opacity_views)                                                                                          \
  DO(ply)                                                                                                    \
  DO(png)                                                                                                    \
  DO(script)                                                                                                 \
  DO(spherical)                                                                                              \
  DO(stage)                                                                                                  \
  DO(transforms)                                                                                             \
  DO(view_file)

namespace surflect {

// Gives bytes to a reader.
using FuzzTarget = void(std::string_view input);
#define SURFLECT_DECLARE_FUZZ_TARGET(NAME) FuzzTarget fuzz_##NAME;
SURFLECT_FUZZ_TARGETS(SURFLECT_DECLARE_FUZZ_TARGET)
#undef SURFLECT_DECLARE_FUZZ_TARGET

// Calls a target. The reader's contract: a valid value, or an Error of one line. Ends the process after an
// Error of more lines; throws whatever else the reader throws.
void requireContract(FuzzTarget& target, std::string_view input);

// An input of two files: three digits say of how many bytes the first one is, and a fourth character of what
// kind they are. Shorter inputs are of no kind, and empty.
struct TwoFiles {
  char kind = 0;
  std::string_view first, second;
};
TwoFiles twoFilesOf(std::string_view input);

// A file in memory, for readers that want a path. One at a time: the next has the same path.
std::filesystem::path memoryFile(std::string_view content);

} // namespace surflect
