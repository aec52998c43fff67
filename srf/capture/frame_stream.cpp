#include "srf/capture/frame_stream.h"

#include "srf/capture/shallow_json.h"

#include <nlohmann/json.hpp>

#include <utility>
#include <vector>

namespace surflect::capture {

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
