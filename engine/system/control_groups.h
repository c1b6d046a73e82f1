#pragma once
#include <functional>
#include <string>
#include <string_view>

namespace penumbra::system {

/// Calls visit(folder) for the control group of this process that `controller` ("cpu", "memory") may limit and for
/// those around it, of version 1 and 2; the folder may not exist. `root` is the file system's, for tests.
void for_each_control_group(const std::string& root, std::string_view controller,
                            const std::function<void(const std::string& folder)>& visit);

}  // namespace penumbra::system
