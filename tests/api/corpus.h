#pragma once
#include <string>
#include <vector>

#include "api/json_document.h"

namespace penumbra::tests {

/// A body and what becomes of it.
struct CorpusEntry {
  std::string name, body;
  int status = 200;
  std::vector<std::string> pointers;  // of the errors, sorted
};

/// The entries of tests/api/corpus/FILE.
std::vector<CorpusEntry> read_corpus(const std::string& file);

/// The bytes of a file under the source folder.
std::string read_source_file(const std::string& path);

/// The JSON text of a value.
std::string text_of(const api::JsonView& value);

}  // namespace penumbra::tests
