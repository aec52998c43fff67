// Memory: uninitialised, kept for reuse, and in use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace surflect {

// Uninitialised memory that is kept for reuse, because fresh pages cost more than filling them.

// Storage for values without initialisation. Not copied.
template <class T> class ScratchBuffer {
public:
  // Returns space for at least `count` values. Reallocates, without keeping values, if the space is too small
  // or more than four times too large.
  T* of(size_t count) {
    constexpr size_t kLittle = 1024; // bytes that are always kept
    const bool isWaste = capacity_ / 4 > count && capacity_ * sizeof(T) > kLittle;
    if (count > capacity_ || isWaste || !values_) { // values_ is null after a move
      values_.reset();
      values_ = std::make_unique_for_overwrite<T[]>(count);
      capacity_ = count;
    }
    return values_.get();
  }
  T* data() { return values_.get(); }
  const T* data() const { return values_.get(); }

private:
  std::unique_ptr<T[]> values_;
  size_t capacity_ = 0;
};

// Vectors that grow without initialising the new elements.

// Like std::allocator, but default-initialises elements: numbers are left uninitialised.
template <class T> struct DefaultInitAllocator : std::allocator<T> {
  DefaultInitAllocator() = default;
  template <class U> DefaultInitAllocator(const DefaultInitAllocator<U>&) noexcept {}

  template <class U> struct rebind { using other = DefaultInitAllocator<U>; };
  template <class U> void construct(U* element) { ::new (static_cast<void*>(element)) U; }
};

// After resize, the new elements must be written before they are read.
template <class T> using UninitializedVector = std::vector<T, DefaultInitAllocator<T>>;

// Memory of this process, as the system reports it.
struct MemoryUse {
  double peakBytes = 0;      // largest resident size since the start or forgetPeakMemory()
  double anonymousBytes = 0; // resident memory that is not mapped from a file (RssAnon)
};
MemoryUse memoryUse();

// Memory that this process may use: the machine's, or less where a control group or a limit of the address
// space says so.
uint64_t availableMemory();

// Throws Error if `bytes` are more than availableMemory(): "needs 97.0 GiB for WHAT, but this process may
// use 24.0 GiB at most".
void requireMemory(double bytes, const std::string& what);

// Returns memory that was freed to the system, and resets the peak.
void forgetPeakMemory();

} // namespace surflect
