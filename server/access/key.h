#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace penumbra::access {

/// What a key may do.
enum class Scope {
  read,     // see jobs and their images
  write,    // submit, cancel and delete jobs
  metrics,  // read /metrics
  admin,    // all of this, for everybody's jobs
};

std::string_view name_of(Scope scope);
std::optional<Scope> scope_of(std::string_view name);

/// A key as it is kept: of its text only the SHA-256.
struct Key {
  std::string id;
  std::string sha256;  // of the whole text, in hexadecimal
  std::string owner;   // jobs belong to owners, who may have several keys
  std::vector<Scope> scopes;
  std::optional<int> requests_per_minute;  // where they differ from the server's
  std::optional<std::size_t> max_jobs;

  bool may(Scope scope) const;
  bool operator==(const Key&) const = default;
};

/// Who makes a call, and what limits them.
struct Caller {
  std::string key_id;                   // empty where no keys are asked for
  std::string owner;                    // of the jobs they make
  bool is_everybody = true;             // sees the jobs of all owners
  std::optional<std::size_t> max_jobs;  // unfinished ones
  int requests_per_minute = 0;          // 0: any number
};

struct NewKey {
  Key key;
  std::string text;  // rs_<id>_<secret>: shown once, kept nowhere
};

/// With a random id and a random secret of 256 bits.
NewKey make_key(std::string owner, std::vector<Scope> scopes);

/// The id in `text` when it has the form of a key.
std::optional<std::string_view> id_of(std::string_view text);

/// Whether `text` is the text of this key, in a time that does not tell how much of it is right.
bool is_text_of(const Key& key, std::string_view text);

/// Whether `text` may be an owner: 1 to 64 letters, digits and any of . _ - @ +
bool is_owner(std::string_view text);

/// One line of a file of keys: id, SHA-256, owner, scopes, and `requests=N` or `jobs=N` where they differ.
std::string line_of(const Key& key);
/// The keys of a file; empty lines and those that begin with # do not count. Throws std::runtime_error that names the
/// line.
std::vector<Key> parse_keys(std::string_view text);

}  // namespace penumbra::access
