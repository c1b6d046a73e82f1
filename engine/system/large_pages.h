#pragma once
#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <new>
#include <utility>

namespace penumbra::system {

/// Memory in pages of 2 MiB, where the system has them to give and so much is wanted: to touch a picture's pages of
/// 4 KiB one by one takes longer than a picture of nothing.
template <class T>
struct LargePages {
  using value_type = T;
  static constexpr std::size_t page = std::size_t{1} << 21;

  LargePages() = default;
  template <class U>
  LargePages(const LargePages<U>&) {}

  T* allocate(std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    const bool is_large = bytes >= page;
    void* memory = is_large ? std::aligned_alloc(page, (bytes + page - 1) / page * page) : std::malloc(bytes);
    if (memory == nullptr) throw std::bad_alloc();
    if (is_large) madvise(memory, bytes, MADV_HUGEPAGE);  // ordinary pages will do as well
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t) { std::free(memory); }
  /// Without a value, nothing is written.
  template <class U, class... Values>
  void construct(U* at, Values&&... values) {
    if constexpr (sizeof...(values) == 0) {
      ::new (static_cast<void*>(at)) U;
    } else {
      ::new (static_cast<void*>(at)) U(std::forward<Values>(values)...);
    }
  }
  bool operator==(const LargePages&) const = default;
};

}  // namespace penumbra::system
