#include "srf/import/output_folder.h"

#include "surfel/error.h"

#include <cerrno>
#include <cstring>
#include <string>
#include <unistd.h>

namespace surflect {

namespace fs = std::filesystem;

namespace {

Error systemError(const fs::path& path, const std::string& action) {
  return Error("cannot " + action + " (" + std::strerror(errno) + ")").in(path);
}

} // namespace

OutputFolder::OutputFolder(fs::path target) : target_(std::move(target)) {
  if (!target_.has_filename()) target_ = target_.parent_path(); // "capture/"
  std::error_code problem;
  if (fs::exists(target_, problem) && !(fs::is_directory(target_, problem) && fs::is_empty(target_, problem)))
    throw Error::mismatch("a new folder, or an empty one", "something there already").in(target_);
  if (target_.has_parent_path()) fs::create_directories(target_.parent_path(), problem);
  std::string name = target_.string() + ".XXXXXX";
  if (!::mkdtemp(name.data())) throw systemError(target_, "write");
  temporary_ = name;
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (!committed_) fs::remove_all(temporary_, ignored);
}

void OutputFolder::commit() {
  std::error_code ignored;
  fs::permissions(temporary_, fs::perms(0755), ignored);
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) throw systemError(target_, "rename to");
  committed_ = true;
}

} // namespace surflect
