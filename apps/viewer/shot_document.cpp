#include "apps/viewer/shot_document.h"

#include "render/scene/script_edit.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <string_view>

namespace surflect::viewer {

namespace {

using Json = nlohmann::json;

// Keys whose text names a file.
constexpr std::array<std::string_view, 7> kFileKeys = {"model", "image", "rest",      "frames",
                                                       "cache", "file",  "background"};

bool namesFile(std::string_view key, const Json& value) {
  return value.is_string() && std::ranges::find(kFileKeys, key) != kFileKeys.end() &&
         (key != "background" || value != "transparent");
}

// Calls visit(file) for each text that names a file, which it may change.
void eachFile(Json& values, const std::function<void(Json& file)>& visit) {
  if (!values.is_structured()) return;
  for (auto& [key, value] : values.items()) {
    if (namesFile(key, value))
      visit(value);
    else
      eachFile(value, visit);
  }
}

void requireFew(const Json& values) {
  const auto require = [](const Json& list, size_t most, const std::string& field) {
    if (list.size() > most)
      throw Error::mismatch(fmt::format("at most {}", most), std::to_string(list.size())).at(field);
  };
  const auto of = [](const Json& object, const char* key) {
    return object.is_object() && object.contains(key) ? object[key] : Json::array();
  };
  require(of(values, "light"), kMostLights, "light");
  require(of(values, "warp"), kMostLights, "warp");
  for (const Json& warp : of(values, "warp")) require(of(warp, "handle"), kMostHandles, "warp.handle");
}

size_t differingLines(std::string_view a, std::string_view b) {
  const auto lines = [](std::string_view text) {
    std::multiset<std::string_view> all;
    for (size_t begin = 0; begin < text.size();) {
      const size_t end = std::min(text.find('\n', begin), text.size());
      all.insert(text.substr(begin, end - begin));
      begin = end + 1;
    }
    return all;
  };
  const auto before = lines(a), after = lines(b);
  std::vector<std::string_view> fresh;
  std::ranges::set_difference(after, before, std::back_inserter(fresh));
  const size_t gone = before.size() - (after.size() - fresh.size());
  return std::max(fresh.size(), gone);
}

bool isKeyframes(const Json& value) {
  return value.is_array() && !value.empty() && std::ranges::all_of(value, [](const Json& key) {
           return key.is_array() && (key.size() == 2 || key.size() == 3) && key[0].is_number() &&
                  key[1].is_number() && (key.size() == 2 || key[2] == "smooth");
         });
}

warp::Track keyframes(const Json& value) {
  std::vector<warp::Keyframe> keys;
  for (const Json& key : value) keys.push_back({key[0].get<double>(), key[1].get<double>(), key.size() == 3});
  return warp::Track::keyframes(std::move(keys));
}

} // namespace

ShotDocument::ShotDocument(std::string text, std::filesystem::path path, const Vec3<double>& origin,
                           std::vector<std::string> images)
    : text_(std::move(text)), path_(std::move(path)), origin_(origin), files_(images.begin(), images.end()),
      saved_(text_) {
  savedValues_ = Json::parse(scene::scriptValues(text_, path_));
  Json own = savedValues_;
  eachFile(own, [&](const Json& file) { files_.insert(file.get<std::string>()); });
  script(text_);
}

Json ShotDocument::values() const {
  const std::lock_guard lock(saving_);
  return savedValues_;
}

std::string ShotDocument::edited(const Json& values) const {
  return inFile(path_, [&] {
    requireFew(values);
    Json named = values;
    eachFile(named, [&](const Json& file) {
      if (!files_.contains(file.get<std::string>()))
        throw Error::mismatch("a file of the script or of the list of environments", file.dump());
    });
    return scene::withValues(text_, path_, values.dump());
  });
}

std::shared_ptr<const scene::Script> ShotDocument::script(const std::string& text) const {
  {
    const std::lock_guard lock(mutex_);
    if (last_ && lastText_ == text) return last_;
  }
  auto script = std::make_shared<scene::Script>(scene::parseScript(text, path_, origin_));
  scene::requireShot(*script);
  const std::lock_guard lock(mutex_);
  lastText_ = text;
  last_ = script;
  return script;
}

size_t ShotDocument::saves() const {
  const std::lock_guard lock(saving_);
  return saves_;
}

size_t ShotDocument::save(const Json& values) {
  const std::string text = edited(values);
  script(text); // throws for what could not be rendered
  const std::lock_guard lock(saving_);
  const bool isThere = std::filesystem::exists(path_);
  if (isThere && readFile(path_) != saved_)
    throw Error("has been changed by another program since it was opened; it was not overwritten").in(path_);
  if (path_.has_parent_path()) createFolder(path_.parent_path());
  writeFileAtomically(path_, std::string_view(text));
  savedValues_ = values;
  ++saves_;
  const std::string before = std::exchange(saved_, text);
  return differingLines(isThere ? before : "", text);
}

std::string ShotDocument::movable(const Json& values, const std::filesystem::path& model) const {
  edited(values); // throws for files that are not the script's
  Json moved = values;
  const std::filesystem::path folder = std::filesystem::absolute(path_).parent_path();
  eachFile(moved, [&](Json& file) { file = (folder / file.get<std::string>()).lexically_normal().string(); });
  moved["model"] = std::filesystem::absolute(model).lexically_normal().string();
  return scene::withValues(text_, path_, moved.dump());
}

Json valuesAt(const Json& values, const warp::ShotTime& time) {
  if (values.is_string()) {
    try {
      return warp::Track::expression(values.get<std::string>()).at(time);
    } catch (const Error&) {
      return values; // a word, or a formula of a place
    }
  }
  if (isKeyframes(values)) return keyframes(values).at(time);
  if (!values.is_structured()) return values;
  Json at = values;
  for (auto& [key, value] : at.items())
    if (key != "type" && key != "smooth") value = valuesAt(value, time);
  return at;
}

} // namespace surflect::viewer
