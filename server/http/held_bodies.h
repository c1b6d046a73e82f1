#pragma once
#include <cstddef>
#include <mutex>

namespace penumbra::http {

/// What the large bodies of all connections take together.
class HeldBodies {
 public:
  static constexpr std::size_t small_body_bytes = 64u << 10;  // not counted

  explicit HeldBodies(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// A body's place, as long as this lives.
  class Place {
   public:
    explicit Place(HeldBodies& bodies) : bodies_(bodies) {}
    ~Place() {
      const std::lock_guard lock(bodies_.mutex_);
      bodies_.bytes_ -= bytes_;
    }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    /// Makes it so large, whatever it was. False when there is no room; one alone may always come.
    bool take(std::size_t bytes) {
      if (bytes <= small_body_bytes) return true;
      const std::lock_guard lock(bodies_.mutex_);
      const std::size_t others = bodies_.bytes_ - bytes_;
      if (others > 0 && others + bytes > bodies_.most_bytes_) return false;
      bytes_ = bytes;
      bodies_.bytes_ = others + bytes;
      return true;
    }

   private:
    HeldBodies& bodies_;
    std::size_t bytes_ = 0;
  };

 private:
  const std::size_t most_bytes_;
  std::mutex mutex_;
  std::size_t bytes_ = 0;  // guarded by mutex_
};

}  // namespace penumbra::http
