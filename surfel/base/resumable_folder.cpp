#include "surfel/base/resumable_folder.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

namespace surflect {

namespace fs = std::filesystem;

void requireResumable(const fs::path& folder, const FolderIdentity& identity) {
  const fs::path path = folder / identity.file;
  if (fs::exists(path)) {
    if (readFile(path, 1 << 16) != identity.text)
      throw Error(identity.problem + ": give the output a folder of its own").in(folder);
    return;
  }
  removeAbandoned(folder, [&](const std::string& name) { return name == identity.file; });
  if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
    throw Error::mismatch("a new folder, or an empty one", "something there already").in(folder);
}

void claimFolder(const fs::path& folder, const FolderIdentity& identity) {
  createFolder(folder);
  if (!fs::exists(folder / identity.file)) writeFileAtomically(folder / identity.file, identity.text);
  createFolder(folder / "images");
  removeAbandoned(folder, [](const std::string&) { return true; });
  removeAbandoned(folder / "images", [](const std::string&) { return true; });
}

} // namespace surflect
