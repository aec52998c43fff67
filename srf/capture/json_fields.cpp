#include "srf/capture/json_fields.h"

#include "srf/capture/rig.h"
#include "srf/image/image.h"
#include "surfel/base/file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace surflect::capture {

namespace {

// Checksum of all fields other than `checksum`.
std::string ownChecksum(Json object) {
  object.erase("checksum");
  return hex(contentHash(object.dump()));
}

} // namespace

Json parseJson(std::string_view content) {
  const std::string_view shallow = shallowPart(content, kDeepestJson);
  try {
    return Json::parse(shallow);
  } catch (const Json::parse_error& e) {
    if (shallow.size() < content.size() && e.byte > shallow.size())
      throw Error("malformed JSON: nested too deeply");
    const size_t end = std::min(e.byte, content.size());
    const auto line =
        1 + std::count(content.begin(), content.begin() + static_cast<std::ptrdiff_t>(end), '\n');
    throw Error("malformed JSON in line " + std::to_string(line) + " (byte " + std::to_string(e.byte) + ")");
  } catch (const Json::exception&) {
    throw Error("malformed JSON: a number is too large");
  }
}

std::string sealedText(Json object) {
  object["checksum"] = ownChecksum(object);
  return object.dump(2) + "\n";
}

Json parseSealed(std::string_view content, std::string_view format, std::initializer_list<int> versions) {
  Json object = parseJson(content);
  objectOf(object);
  if (const Json& found = valueAt(object, "format"); !isText(found, format))
    throw Error::mismatch('"' + std::string(format) + '"', shown(found)).at("format");
  const Json& version = valueAt(object, "version");
  std::string expected;
  for (const int known : versions) expected += (expected.empty() ? "" : " or ") + std::to_string(known);
  if (std::none_of(versions.begin(), versions.end(), [&](int known) { return version == known; }))
    throw Error::mismatch(expected, shown(version)).at("version");
  if (const std::string stated = required(object, "checksum", textOf), found = ownChecksum(object);
      stated != found)
    throw Error::mismatch(stated, found).at("checksum");
  return object;
}

std::string shown(const Json& value) {
  if (value.is_null()) return "nothing";
  if (value.is_object()) return "an object";
  if (value.is_array()) return "a list of " + std::to_string(value.size());
  const std::string text = value.dump();
  return text.size() <= 60 ? text : text.substr(0, 57) + "...";
}

std::string element(const std::string& list, size_t index) {
  return std::string(list).append("[").append(std::to_string(index)).append("]");
}

const Json& valueAt(const Json& object, const char* key) {
  static const Json nothing;
  const auto found = object.find(key);
  return found == object.end() ? nothing : *found;
}

bool isNull(const Json& value) { return value.is_null(); }

const Json& objectOf(const Json& value) {
  if (!value.is_object()) throw Error::mismatch("an object", shown(value));
  return value;
}

const Json& listOf(const Json& value) {
  if (!value.is_array()) throw Error::mismatch("a list", shown(value));
  return value;
}

std::string textOf(const Json& value) {
  if (!value.is_string()) throw Error::mismatch("a string", shown(value));
  return value.get<std::string>();
}

double numberOf(const Json& value) {
  if (!value.is_number()) throw Error::mismatch("a number", shown(value));
  return value.get<double>();
}

double positiveOf(const Json& value) {
  const double x = value.is_number() ? value.get<double>() : 0;
  if (!(x >= 1e-12 && x <= 1e12)) throw Error::mismatch("a number above 0 (1e-12 to 1e12)", shown(value));
  return x;
}

double coordinateOf(const Json& value) {
  const double x = numberOf(value);
  if (!(std::abs(x) <= kFarthest)) throw Error::mismatch("a number from -1e12 to 1e12", shown(value));
  return x;
}

int pixelCountOf(const Json& value) {
  const double x = value.is_number() ? value.get<double>() : 0; // some exporters write 800.0
  if (!(x >= 1 && x <= image::kMostSide && x == std::floor(x)))
    throw Error::mismatch("a whole number from 1 to " + std::to_string(image::kMostSide), shown(value));
  return static_cast<int>(x);
}

Vec3<double> tripleOf(const Json& value) {
  const bool three = value.is_array() && value.size() == 3 &&
                     std::all_of(value.begin(), value.end(), [](const Json& v) { return v.is_number(); });
  if (!three)
    throw Error::mismatch("three numbers", value.is_array() ? value.dump().substr(0, 60) : shown(value));
  return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

Vec3<double> boundedTripleOf(const Json& value) {
  const Vec3<double> v = tripleOf(value);
  if (!(v.cwiseAbs().maxCoeff() <= kFarthest))
    throw Error::mismatch("three numbers from -1e12 to 1e12", value.dump().substr(0, 60));
  return v;
}

Point3<AcquisitionSpace, double> pointOf(const Json& value) {
  return assume<Point3<AcquisitionSpace, double>>(boundedTripleOf(value));
}

Rgb strengthsOf(const Json& value) {
  const Vec3<float> rgb = tripleOf(value).cast<float>(); // the writer's bounds are floats
  if (!(rgb.minCoeff() >= kLeastStrength && rgb.maxCoeff() <= kMostStrength))
    throw Error::mismatch("three numbers above 0 (1e-12 to 1e12)", value.dump().substr(0, 60));
  return {rgb[0], rgb[1], rgb[2]};
}

Rgb strengthsOrGrayOf(const Json& value) {
  return value.is_number() ? static_cast<float>(positiveOf(value)) * Rgb{1, 1, 1} : strengthsOf(value);
}

bool isText(const Json& value, std::string_view text) {
  return value.is_string() && value.get_ref<const std::string&>() == text;
}

namespace {

// Builds the tree of the root, and one of a frame at a time. A handler that returns false ends the parsing.
class FrameHandler : public nlohmann::json_sax<Json> {
public:
  FrameHandler(const std::function<void(const Json&)>& begin, const std::function<void(const Json&)>& add)
      : begin_(begin), add_(add) {}

  bool hasFrames() const { return frames_ > 0; }

  bool null() override { return put(nullptr); }
  bool boolean(bool value) override { return put(value); }
  bool number_integer(number_integer_t value) override { return put(value); }
  bool number_unsigned(number_unsigned_t value) override { return put(value); }
  bool number_float(number_float_t value, const string_t&) override { return put(value); }
  bool string(string_t& value) override { return put(std::move(value)); }
  bool binary(binary_t&) override { return false; }

  bool start_object(size_t) override {
    if (!open_.empty()) return isAmongFrames() ? openFrame() : put(Json::object(), true);
    open_.push_back(&(root_ = Json::object()));
    return true;
  }
  bool key(string_t& name) override {
    if (open_.size() == 1) {
      if (place_ == Place::afterFrames) return false;
      if (name == "frames") place_ = Place::atFrames;
    }
    slot_ = &(*open_.back())[name];
    return true;
  }
  bool end_object() override {
    open_.pop_back();
    if (isAmongFrames()) add_(frame_);
    return true;
  }
  bool start_array(size_t) override {
    if (place_ == Place::atFrames) place_ = Place::inFrames;
    return put(Json::array(), true);
  }
  bool end_array() override {
    open_.pop_back();
    if (open_.size() == 1 && place_ == Place::inFrames) place_ = Place::afterFrames;
    return true;
  }
  bool parse_error(size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

private:
  enum class Place { beforeFrames, atFrames, inFrames, afterFrames };

  // Returns whether the innermost open value is the list of frames.
  bool isAmongFrames() const { return place_ == Place::inFrames && open_.size() == 2; }

  bool openFrame() {
    if (frames_++ == 0) begin_(root_);
    open_.push_back(&(frame_ = Json::object()));
    return true;
  }

  // Puts a value into the innermost open list or object, and opens it if it is one itself.
  bool put(Json value, bool opens = false) {
    if (open_.empty() || isAmongFrames() || (place_ == Place::atFrames)) return false;
    Json& parent = *open_.back();
    Json& placed = parent.is_array() ? parent.emplace_back(std::move(value)) : (*slot_ = std::move(value));
    if (opens) open_.push_back(&placed);
    return true;
  }

  const std::function<void(const Json&)>&begin_, &add_;
  Json root_, frame_;
  std::vector<Json*> open_; // values that are not complete, the outermost first
  Json* slot_ = nullptr;    // of the last key
  Place place_ = Place::beforeFrames;
  size_t frames_ = 0;
};

} // namespace

bool streamFrames(std::string_view content, const std::function<void(const Json& root)>& begin,
                  const std::function<void(const Json& frame)>& add) {
  if (shallowPart(content, kDeepestJson).size() < content.size()) return false;
  FrameHandler handler(begin, add);
  return Json::sax_parse(content, &handler) && handler.hasFrames();
}

} // namespace surflect::capture
