// Ownership of one OpenGL object.
#pragma once

#include <utility>

namespace surflect::gl {

// Name of an object that is deleted with its owner; 0 is no object.
class Handle {
public:
  using Delete = void (*)(unsigned name);

  Handle(unsigned name, Delete deleteObject) : name_(name), delete_(deleteObject) {}
  ~Handle() {
    if (name_) delete_(name_);
  }
  Handle(Handle&& other) noexcept : name_(std::exchange(other.name_, 0)), delete_(other.delete_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(name_, other.name_);
    std::swap(delete_, other.delete_);
    return *this;
  }

  unsigned name() const { return name_; }

private:
  unsigned name_;
  Delete delete_;
};

} // namespace surflect::gl
