#pragma once
#include <string>
#include <vector>

#include "api/job_request.h"
#include "engine/render/film.h"

namespace penumbra::test {

struct NamedJob {
  std::string name;
  api::JobRequest job;
};

/// Two dozen different scenes in small pictures: example scenes and made ones, with one and with eight soft lights,
/// area lights, spheres, meshes, coloured glass, mirrors, a lens, several camera rays, large and small lights.
std::vector<NamedJob> estimate_scenes();

/// The mean of two pictures by seeds of their own, and what their difference tells of its squared error.
struct Reference {
  render::Film::Values mean;
  double squared_noise;
};
Reference reference_of(api::JobRequest job);

}  // namespace penumbra::test
