// The script that a page edits: its text on disk, and the texts and scripts of edited values.
#pragma once

#include "render/scene/script.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

namespace surflect::viewer {

// Most lights of a script, and most handles of a warp, that a page may ask for.
inline constexpr size_t kMostLights = 64, kMostHandles = 64;

class ShotDocument {
public:
  // text: of a script with a model, frames, output and camera. path: where save() writes it. origin:
  // Capture::origin of the model. images: environments that lights may name beside those of the text. Throws
  // Error as parseScript() and requireShot().
  ShotDocument(std::string text, std::filesystem::path path, const Vec3<double>& origin,
               std::vector<std::string> images);

  // The text as it was read. Edited values refer to it, also after save(): their places "#" do not change.
  const std::string& text() const { return text_; }
  const std::filesystem::path& path() const { return path_; }
  // Values as they were saved last; before that, as scene::scriptValues. Safe from many threads.
  nlohmann::json values() const;

  // The text with edited values. Throws Error as scene::withValues, and for too many lights or handles, or a
  // file that neither the text nor `images` names: a page must not choose what is read.
  std::string edited(const nlohmann::json& values) const;

  // Script of an edited text; the last one is kept, as it may have read files. Throws Error as parseScript()
  // and requireShot(). Safe from many threads.
  std::shared_ptr<const scene::Script> script(const std::string& text) const;

  // Number of save()s so far: a page that knows fewer would overwrite another page's edits.
  size_t saves() const;
  // Writes the edited text to path(); returns the number of lines that differ from those of the file. Throws
  // Error if the file has been changed by others since it was read or saved. Safe from many threads.
  size_t save(const nlohmann::json& values);

  // Edited text of a model's shot whose files are absolute, so that it may stand in another folder.
  std::string movable(const nlohmann::json& values, const std::filesystem::path& model) const;

private:
  const std::string text_;
  const std::filesystem::path path_;
  const Vec3<double> origin_;
  std::set<std::string> files_; // that values may name
  mutable std::mutex saving_;
  std::string saved_; // text of the file
  nlohmann::json savedValues_;
  size_t saves_ = 0;
  mutable std::mutex mutex_;
  mutable std::string lastText_;
  mutable std::shared_ptr<const scene::Script> last_;
};

// Numbers of a script's values at a frame: keyframes and expressions become their values, all else stays.
nlohmann::json valuesAt(const nlohmann::json& values, const warp::ShotTime& time);

} // namespace surflect::viewer
