// A folder that appears whole, or not at all.
#pragma once

#include <filesystem>

namespace surflect::importers {

// Filled beside the target, in a folder TARGET.tmp.XXXXXX, and renamed by commit(); dropped by the destructor
// otherwise. What a killed process has left of the same target is removed first. The target must not be there
// yet, or be an empty folder; throws Error.
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
  int descriptor_ = -1; // of the temporary, locked while this lives
  bool committed_ = false;
};

} // namespace surflect::importers
