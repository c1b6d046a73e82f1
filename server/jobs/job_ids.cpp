#include "server/jobs/job_ids.h"

#include <sys/random.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace penumbra::jobs {

namespace {

constexpr std::string_view digits = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";
constexpr std::size_t time_digits = 10, random_digits = 16, id_size = time_digits + random_digits;

std::string fresh_id(api::Time now) {
  auto milliseconds =
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count());
  std::array<unsigned char, random_digits> random;
  if (getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size()))
    throw std::system_error(errno, std::generic_category(), "getrandom");
  std::string id(id_size, '0');
  for (std::size_t i = time_digits; i-- > 0; milliseconds >>= 5) id[i] = digits[milliseconds & 31];
  for (std::size_t i = 0; i < random_digits; ++i) id[time_digits + i] = digits[random[i] & 31];
  return id;
}

}  // namespace

JobIds::JobIds(const std::string& newest) : last_(is_job_id(newest) ? newest : "") {}

std::string JobIds::next(api::Time now) {
  std::string id = fresh_id(now);
  const std::lock_guard lock(mutex_);
  if (id <= last_) {
    // The same millisecond, or a clock set back: keep the time and the first random half of the last id, counted up.
    std::string successor = last_;
    for (std::size_t i = time_digits + random_digits / 2; i-- > 0;) {
      const std::size_t digit = digits.find(successor[i]);
      successor[i] = digits[(digit + 1) % digits.size()];
      if (digit + 1 < digits.size()) break;
    }
    std::copy(id.begin() + time_digits + random_digits / 2, id.end(),
              successor.begin() + time_digits + random_digits / 2);
    id = successor;
  }
  return last_ = id;
}

bool is_job_id(std::string_view text) {
  return text.size() == id_size && text.find_first_not_of(digits) == std::string_view::npos;
}

}  // namespace penumbra::jobs
