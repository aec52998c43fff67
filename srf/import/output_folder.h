// Output folder that appears complete or not at all.
#pragma once

#include <filesystem>

namespace surflect::importers {

// Filled beside the target, in a folder TARGET.tmp.XXXXXX, and renamed by commit(); otherwise removed by the
// destructor. First removes what a killed process has left for the same target. The target must not exist, or
// be an empty folder; throws Error.
class OutputFolder {
public:
  explicit OutputFolder(std::filesystem::path target);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  const std::filesystem::path& temporaryPath() const { return temporary_; }
  void commit();

private:
  std::filesystem::path target_, temporary_;
  int descriptor_ = -1; // of the temporary folder; locked during the object's lifetime
  bool committed_ = false;
};

} // namespace surflect::importers
