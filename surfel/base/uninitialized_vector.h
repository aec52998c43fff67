// Vectors that grow without initialising the new elements.
#pragma once

#include <memory>
#include <new>
#include <vector>

namespace surflect {

// Like std::allocator, but default-initialises elements: numbers are left uninitialised.
template <class T> struct DefaultInitAllocator : std::allocator<T> {
  DefaultInitAllocator() = default;
  template <class U> DefaultInitAllocator(const DefaultInitAllocator<U>&) noexcept {}

  template <class U> struct rebind { using other = DefaultInitAllocator<U>; };
  template <class U> void construct(U* element) { ::new (static_cast<void*>(element)) U; }
};

// After resize, the new elements must be written before they are read.
template <class T> using UninitializedVector = std::vector<T, DefaultInitAllocator<T>>;

} // namespace surflect
