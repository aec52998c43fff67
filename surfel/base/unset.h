// Vectors that grow without setting what they have grown by.
#pragma once

#include <memory>
#include <new>
#include <vector>

namespace surflect {

// As std::allocator, but elements that are made of nothing are default-initialized: numbers keep what was in
// their memory.
template <class T> struct UnsetAllocator : std::allocator<T> {
  UnsetAllocator() = default;
  template <class U> UnsetAllocator(const UnsetAllocator<U>&) noexcept {}

  template <class U> struct rebind { using other = UnsetAllocator<U>; };
  template <class U> void construct(U* element) { ::new (static_cast<void*>(element)) U; }
};

// After resize the new elements must be written before they are read.
template <class T> using UnsetVector = std::vector<T, UnsetAllocator<T>>;

} // namespace surflect
