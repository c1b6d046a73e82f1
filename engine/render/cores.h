#pragma once
#include <filesystem>
#include <optional>

namespace penumbra::render {

/// Processors this process may use, at least 1: those it may run on, and no more than its control group grants time
/// for.
int available_cores();

/// Processors' worth of time, rounded up, that the control group in the folder `group`, and those it is in up to
/// `root`, may use; nothing where none has a limit. Reads cpu.max of version 2 and cpu.cfs_quota_us of version 1.
std::optional<int> granted_cores(std::filesystem::path group, const std::filesystem::path& root);

}  // namespace penumbra::render
