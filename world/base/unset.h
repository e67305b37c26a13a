/// Vectors whose elements are not set when they are made: for large ones that are written whole at once, where setting
/// them first would cost as much again.
#pragma once

#include <memory>
#include <new>
#include <type_traits>
#include <utility>

namespace world {

/// std::allocator, but that an element made of nothing is left as its memory is. `T` must be trivial to copy.
template <class T>
struct UnsetAllocator : std::allocator<T> {
  static_assert(std::is_trivially_copyable_v<T>);
  template <class U>
  struct rebind {
    using other = UnsetAllocator<U>;
  };
  template <class U>
  void construct(U*) noexcept {}
  template <class U, class... Arguments>
  void construct(U* place, Arguments&&... arguments) {
    ::new (static_cast<void*>(place)) U(std::forward<Arguments>(arguments)...);
  }
};

}  // namespace world
