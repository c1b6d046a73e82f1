#pragma once
#include <string>

namespace penumbra::system {

/// Processors this process may use, at least 1: those it may run on, and no more than the control groups (version 1 or
/// 2) it is in are granted time for, rounded up. `root` is the file system's, for tests.
int available_cores(const std::string& root = "");

}  // namespace penumbra::system
