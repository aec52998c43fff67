// Errors of the outside world (files, arguments), as one line that a user can act on:
//
//   scan/transforms.json: lights[12].direction: found length 0, expected a unit vector
//
// Our own mistakes are asserts, not Errors.
#pragma once

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace surflect {

// Number for messages: eight digits, without trailing zeros.
inline std::string numberText(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.8g", number);
  return text;
}

class Error : public std::exception {
public:
  // Problem without an expected value: "cannot open (permission denied)".
  explicit Error(std::string problem) : problem_(std::move(problem)) { compose(); }
  static Error mismatch(std::string_view expected, std::string_view found) {
    return Error("found " + std::string(found) + ", expected " + std::string(expected));
  }

  // Adds an outer field, innermost first: error.at("direction").at("lights[12]").in(path).
  Error at(std::string_view outerField) && {
    const bool joined = field_.empty() || field_.front() == '[';
    field_ = std::string(outerField) + (joined ? "" : ".") + field_;
    compose();
    return std::move(*this);
  }
  // Adds the file, unless an inner call has: the innermost file is where the user must look.
  Error in(const std::filesystem::path& file) && {
    if (file_.empty()) file_ = file.string();
    compose();
    return std::move(*this);
  }

  const std::string& file() const { return file_; }
  const std::string& field() const { return field_; }
  const char* what() const noexcept override { return line_.c_str(); }

private:
  void compose() {
    line_.clear();
    if (!file_.empty()) line_ += file_ + ": ";
    if (!field_.empty()) line_ += field_ + ": ";
    line_ += problem_;
    // Names come from outside; keep the message on one line and free of terminal control codes.
    for (char& c : line_)
      if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
  }

  std::string file_, field_, problem_, line_;
};

// Thrown out of long work when the caller's Progress requests it.
class Cancelled : public std::exception {
public:
  const char* what() const noexcept override { return "interrupted"; }
};

// Field and file that an Error of some work is given on its way up.

// Returns work(); its Errors get the outer field.
template <class Work> decltype(auto) atField(std::string_view field, const Work& work) {
  try {
    return work();
  } catch (Error& error) {
    throw std::move(error).at(field);
  }
}

// Returns work(); its Errors get the file.
template <class Work> decltype(auto) inFile(const std::filesystem::path& file, const Work& work) {
  try {
    return work();
  } catch (Error& error) {
    throw std::move(error).in(file);
  }
}

} // namespace surflect
