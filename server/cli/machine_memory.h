#pragma once
#include <cstddef>
#include <string>

namespace penumbra::cli {

/// Bytes of memory this process may use: the machine's, or less where a control group (version 1 or 2) of the process
/// or one above it says so. 0 when nothing is known. `root` is the file system's, for tests.
std::size_t machine_memory_bytes(const std::string& root = "");

}  // namespace penumbra::cli
