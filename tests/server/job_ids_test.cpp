#include <doctest/doctest.h>

#include <set>
#include <thread>

#include "server/jobs/job_ids.h"

using penumbra::jobs::is_job_id;
using penumbra::jobs::JobIds;

TEST_CASE("ids grow, even within a millisecond and when the clock is set back") {
  JobIds ids;
  const auto now = std::chrono::system_clock::now();
  std::string last = ids.next(now);
  for (int i = 0; i < 1000; ++i) {
    const std::string id = ids.next(i % 2 == 0 ? now : now - std::chrono::hours(1));
    CHECK(is_job_id(id));
    REQUIRE(id > last);
    last = id;
  }
  CHECK(ids.next(now + std::chrono::hours(1)) > last);
}

TEST_CASE("ids of many threads are different") {
  JobIds ids;
  std::vector<std::vector<std::string>> made(4);
  {
    std::vector<std::jthread> threads;
    for (auto& mine : made)
      threads.emplace_back([&] {
        for (int i = 0; i < 500; ++i) mine.push_back(ids.next(std::chrono::system_clock::now()));
      });
  }
  std::set<std::string> all;
  for (const auto& mine : made) all.insert(mine.begin(), mine.end());
  CHECK(all.size() == 2000);
}

TEST_CASE("what is no id") {
  CHECK(is_job_id("01JDF3Z4N6Q8R0S2T4V6X8Y0Z2"));
  CHECK_FALSE(is_job_id(""));
  CHECK_FALSE(is_job_id("01JDF3Z4N6Q8R0S2T4V6X8Y0Z"));
  CHECK_FALSE(is_job_id("01JDF3Z4N6Q8R0S2T4V6X8Y0Zu"));
}
