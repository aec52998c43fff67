// Vectors that grow without setting what they have grown by.
#pragma once

#include <memory>
#include <new>
#include <vector>

namespace surflect {

// As std::allocator, but elements that are made of nothing are default-initialized: numbers keep what was in
// their memory.
template <class T> struct DefaultInitAllocator : std::allocator<T> {
  DefaultInitAllocator() = default;
  template <class U> DefaultInitAllocator(const DefaultInitAllocator<U>&) noexcept {}

  template <class U> struct rebind { using other = DefaultInitAllocator<U>; };
  template <class U> void construct(U* element) { ::new (static_cast<void*>(element)) U; }
};

// After resize the new elements must be written before they are read.
template <class T> using UninitializedVector = std::vector<T, DefaultInitAllocator<T>>;

} // namespace surflect
