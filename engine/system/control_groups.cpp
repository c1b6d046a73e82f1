#include "engine/system/control_groups.h"

#include <algorithm>
#include <fstream>

namespace penumbra::system {

void for_each_control_group(const std::string& root, std::string_view controller,
                            const std::function<void(const std::string& folder)>& visit) {
  const std::string name(controller);
  std::ifstream groups(root + "/proc/self/cgroup");
  // Lines of hierarchy:controllers:path; version 2 has the hierarchy 0 and no controllers.
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    std::string top = root + "/sys/fs/cgroup";
    if (controllers != ",,") {
      if (controllers.find("," + name + ",") == std::string::npos) continue;
      top += "/" + name;
    }
    // In a container the path may be one it does not see; its own group is at the top then.
    std::string path = line.substr(second + 1);
    if (path == "/") path.clear();
    while (true) {
      visit(top + path);
      if (path.empty()) break;
      path.erase(std::min(path.rfind('/'), path.size()));
    }
  }
}

}  // namespace penumbra::system
