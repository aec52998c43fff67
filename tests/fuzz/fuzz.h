// Shared part of the fuzz targets. A target is a file NAME_fuzz.cpp that defines fuzz(), a line in
// CMakeLists.txt, and seeds: small files in seeds/NAME/, or made by tests/support/write_seeds.cpp.
#pragma once

#include <filesystem>
#include <string_view>

namespace surflect {

// Gives the bytes to a reader. The reader's contract: a valid value, or an Error of one line. Any other
// exception, and whatever the sanitizers find, ends the process.
void fuzz(std::string_view input);

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
