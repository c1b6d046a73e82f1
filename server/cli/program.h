#pragma once

namespace penumbra::cli {

/// What `penumbra` does for its arguments. Returns its exit status.
int run(int argc, const char* const* argv);

}  // namespace penumbra::cli
