// Helpers for tests of files: a temporary folder, bytes on disk, and the Error of a call.
#pragma once

#include "srf/image/image.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <unistd.h>

namespace surflect::image {

class TemporaryFolder {
public:
  TemporaryFolder() {
    std::string name = std::filesystem::temp_directory_path() / "surflect.XXXXXX";
    if (!::mkdtemp(name.data())) throw Error("no temporary folder");
    path_ = name;
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

private:
  std::filesystem::path path_;
};

inline void writeBytes(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::remove(path); // quicker than overwriting, which some file systems flush
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// The bytes of every file below the folder, by relative path.
inline std::map<std::string, std::string> contentOf(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[entry.path().lexically_relative(folder).string()] = readFile(entry.path());
  return files;
}

// Content of a model without the identity of its source.
inline std::map<std::string, std::string> modelContentOf(const std::filesystem::path& folder) {
  auto files = contentOf(folder);
  files.erase("views/identity");
  return files;
}

// The line of the Error that the call throws; empty, and a failure, if it throws none.
template <class Call> std::string errorOf(Call call) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << "one line";
    return e.what();
  }
  ADD_FAILURE() << "no Error";
  return "";
}

inline Image randomImage(int width, int height, int channels, float low, float high, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(low, high);
  Image image(width, height, channels);
  for (float& v : image.values) v = value(random);
  return image;
}

} // namespace surflect::image
