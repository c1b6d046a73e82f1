#pragma once
#include <memory>
#include <optional>

#include "engine/render/control.h"
#include "engine/render/film.h"
#include "engine/render/stats.h"
#include "engine/render/switches.h"
#include "engine/scene/description.h"
#include "engine/scene/options.h"
#include "engine/system/pool.h"

namespace penumbra::render {

struct Picture {
  std::shared_ptr<const Film> film;
  Stats stats;
};

/// The whole way from a description to linear floats: compiles the scene, traces it on `pool` and reports through
/// `control`. Returns nothing if `control` was canceled. The image depends only on scene and options, not on the pool.
std::optional<Picture> render(const scene::Description& description, const scene::Options& options, system::Pool& pool,
                              Control& control, const Switches& switches = {});

/// How many of `pool_size` threads a render with `options.threads` may use (section 3 of the contract).
int thread_limit(int threads, int pool_size);

}  // namespace penumbra::render
