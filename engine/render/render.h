#pragma once
#include <optional>

#include "engine/render/control.h"
#include "engine/render/film.h"
#include "engine/render/pool.h"
#include "engine/render/stats.h"
#include "engine/scene/description.h"
#include "engine/scene/options.h"
#include "engine/shading/switches.h"

namespace penumbra::render {

struct Picture {
  Film film;
  Stats stats;
};

/// Parts of the renderer that only save time. Each may be switched off: the image stays the same.
struct Switches : shading::Switches {
  bool merge_lights = true;  // equal lights are evaluated once
  bool empty_tiles = true;   // no ray is cast where a tile shows nothing but the background
};

/// The whole way from a description to linear floats: compiles the scene, traces it on `pool` and reports through
/// `control`. Returns nothing if `control` was canceled. The image depends only on scene and options, not on the pool.
std::optional<Picture> render(const scene::Description& description, const scene::Options& options, Pool& pool,
                              Control& control, const Switches& switches = {});

/// How many of `pool_size` threads a render with `options.threads` may use (section 3 of the contract).
int thread_limit(int threads, int pool_size);

}  // namespace penumbra::render
