// Output folder that is filled over a long time and resumed after an interruption. A file in it states what
// it is the output of.
#pragma once

#include <filesystem>
#include <string>

namespace surflect {

struct FolderIdentity {
  std::string file;    // name of the stating file, such as "stage.identity"
  std::string text;    // equal for equal input
  std::string problem; // of a folder with another text: "is of another stage file"
};

// Throws Error if the folder holds anything but output of this identity. It may be missing or empty.
void requireResumable(const std::filesystem::path& folder, const FolderIdentity& identity);

// Creates the folder and its folder `images` and states the identity. Removes temporaries of killed runs.
// Call requireResumable() first. Throws Error.
void claimFolder(const std::filesystem::path& folder, const FolderIdentity& identity);

} // namespace surflect
