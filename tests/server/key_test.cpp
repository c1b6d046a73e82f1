#include <doctest/doctest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "server/access/key_ring.h"
#include "server/access/rate_limiter.h"
#include "server/store/sha256.h"
#include "tests/server/fixture.h"

using namespace penumbra::access;
using std::chrono::milliseconds;
using std::chrono::seconds;

TEST_CASE("a key is told from its text alone, of which only the hash is kept") {
  const NewKey made = make_key("alice", {Scope::read, Scope::write});
  CHECK(made.text.starts_with("rs_" + made.key.id + "_"));
  CHECK(id_of(made.text) == made.key.id);
  CHECK(made.key.sha256 == penumbra::store::sha256_hex(made.text));
  CHECK(is_text_of(made.key, made.text));
  const std::string line = line_of(made.key);
  CHECK(line.find(made.text.substr(made.text.rfind('_') + 1)) == std::string::npos);
  CHECK(parse_keys("# a comment\n\n" + line + "\n") == std::vector<Key>{made.key});

  for (std::size_t i = 0; i < made.text.size(); ++i) {
    std::string other = made.text;
    other[i] = other[i] == 'x' ? 'y' : 'x';
    CHECK_FALSE(is_text_of(made.key, other));
  }
  CHECK_FALSE(is_text_of(made.key, ""));
  std::set<std::string> texts;
  for (int i = 0; i < 1000; ++i) texts.insert(make_key("a", {}).text);
  CHECK(texts.size() == 1000);
}

TEST_CASE("limits of a key's own are kept in its line") {
  Key key = make_key("a.b@c", {Scope::admin}).key;
  key.requests_per_minute = 7;
  key.max_jobs = 3;
  CHECK(parse_keys(line_of(key)).at(0) == key);
  CHECK(key.may(Scope::write));
  CHECK_FALSE(make_key("a", {Scope::read}).key.may(Scope::write));
}

TEST_CASE("a file with a line that is no key is refused, with its number") {
  const Key key = make_key("alice", {Scope::read}).key;
  const std::string good = line_of(key);
  const std::string hash = key.sha256;
  for (const std::string& bad :
       {std::string("nonsense"), key.id + " " + hash + " alice", key.id + " " + hash + " alice paint",
        key.id + " " + hash.substr(1) + " alice metrics", "x " + hash + " alice metrics",
        key.id + " " + hash + " al\x01ice metrics", good + " requests=0", good + " requests=-1", good + " jobs=x",
        good + " more", good + "\n" + good}) {
    try {
      parse_keys("\n" + bad);
      FAIL(bad);
    } catch (const std::runtime_error& error) {
      CHECK(std::string(error.what()).starts_with(bad.find('\n') == std::string::npos ? "line 2" : "line 3"));
    }
  }
}

TEST_CASE("keys are read again after a change, and a bad file changes nothing") {
  const penumbra::test::TemporaryDirectory folder;
  const std::string file = folder / "keys";
  const NewKey first = make_key("a", {Scope::read}), second = make_key("b", {Scope::read});
  write_keys(file, line_of(first.key) + "\n");
  struct stat state {};
  REQUIRE(::stat(file.c_str(), &state) == 0);
  CHECK((state.st_mode & 0777) == 0600);

  KeyRing ring(file);
  REQUIRE(ring.find(first.text));
  CHECK(ring.find(first.text)->owner == "a");
  CHECK_FALSE(ring.find(second.text));
  CHECK_FALSE(ring.find("rs_"));
  CHECK_FALSE(ring.find(first.text.substr(0, 16) + second.text.substr(16)));

  write_keys(file, line_of(second.key) + "\n");
  CHECK(eventually([&] { return ring.find(second.text) && !ring.find(first.text); }));
  std::ofstream(file) << "nonsense\n";
  ring.reload();
  CHECK(ring.find(second.text));
  std::filesystem::remove(file);
  ring.reload();
  CHECK(ring.find(second.text));
  CHECK_THROWS_AS(KeyRing(folder / "none"), std::runtime_error);
}

TEST_CASE("a bucket of calls empties, and fills with time") {
  RateLimiter limiter;
  const RateLimiter::Clock::time_point start{};
  for (int i = 0; i < 6; ++i) {
    const Rate rate = limiter.take("a", 6, start);
    CHECK(rate.is_within);
    CHECK(rate.remaining == 5 - i);
    CHECK(rate.reset_s == 10 * (i + 1));
  }
  const Rate over = limiter.take("a", 6, start + seconds(1));
  CHECK_FALSE(over.is_within);
  CHECK(over.remaining == 0);
  CHECK(over.retry_after_s == 9);
  CHECK_FALSE(limiter.take("a", 6, start + milliseconds(9990)).is_within);
  CHECK(limiter.take("b", 6, start).is_within);
  // Refused calls cost nothing: after the time that was named the next one is free.
  CHECK(limiter.take("a", 6, start + seconds(10)).is_within);
  CHECK_FALSE(limiter.take("a", 6, start + seconds(10)).is_within);
  CHECK(limiter.take("a", 6, start + seconds(1000)).remaining == 5);
}
