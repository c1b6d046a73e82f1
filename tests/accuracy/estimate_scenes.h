#pragma once
#include <string>
#include <vector>

#include "api/job_request.h"

namespace penumbra::test {

struct NamedJob {
  std::string name;
  api::JobRequest job;
};

/// Two dozen different scenes in small pictures: example scenes and made ones, with one and with eight soft lights,
/// area lights, spheres, meshes, coloured glass, mirrors, a lens, several camera rays, large and small lights.
std::vector<NamedJob> estimate_scenes();

}  // namespace penumbra::test
