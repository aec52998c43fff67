// Temporary folder for inputs that name other files, with pictures of 4 x 3 pixels.
#pragma once

#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "surfel/base/file.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace surflect {

class FuzzFolder {
public:
  FuzzFolder() {
    std::string name = std::filesystem::temp_directory_path() / "surflect_fuzz.XXXXXX";
    if (!::mkdtemp(name.data())) std::abort();
    path_ = name;
    const image::Image picture(4, 3, 4);
    image::writePng(path_ / "a.png", picture);
    image::writeExr(path_ / "a.exr", picture);
    writeFileAtomically(path_ / "mesh.ply", std::string_view("not read here"));
  }
  ~FuzzFolder() { std::filesystem::remove_all(path_); }
  FuzzFolder(const FuzzFolder&) = delete;
  FuzzFolder& operator=(const FuzzFolder&) = delete;

  void write(const std::string& name, std::string_view content) const {
    std::ofstream(path_ / name, std::ios::binary) << content;
  }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

private:
  std::filesystem::path path_;
};

} // namespace surflect
