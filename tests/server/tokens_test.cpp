#include "server/access/tokens.h"

#include <doctest/doctest.h>

using namespace penumbra::access;
using std::chrono::milliseconds;

TEST_CASE("a token names its key for ten minutes, to the server that made it") {
  const Tokens tokens;
  const Tokens::Clock::time_point now = Tokens::Clock::now();
  const std::string token = tokens.make("abc123", now);
  CHECK(tokens.key_id_of(token, now) == "abc123");
  CHECK(tokens.key_id_of(token, now + Tokens::lifetime - milliseconds(2)) == "abc123");
  CHECK_FALSE(tokens.key_id_of(token, now + Tokens::lifetime));
  CHECK_FALSE(Tokens().key_id_of(token, now));
  CHECK(tokens.key_id_of(tokens.make("", now), now) == "");
}

TEST_CASE("whatever else is no token") {
  const Tokens tokens;
  const Tokens::Clock::time_point now = Tokens::Clock::now();
  const std::string token = tokens.make("abc123", now);
  for (std::size_t i = 0; i < token.size(); ++i) {
    std::string other = token;
    other[i] = other[i] == '1' ? '2' : '1';
    CHECK_FALSE(tokens.key_id_of(other, now));
    CHECK_FALSE(tokens.key_id_of(token.substr(0, i), now));
  }
  CHECK_FALSE(tokens.key_id_of(token + "0", now));
  CHECK_FALSE(tokens.key_id_of(std::string(100'000, '.'), now));
}
