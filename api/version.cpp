#include "api/version.h"

namespace penumbra::api {

std::string_view version() { return PENUMBRA_VERSION; }

std::string_view engine_hash() { return PENUMBRA_ENGINE_HASH; }

std::string_view short_engine_hash() { return engine_hash().substr(0, 12); }

std::string program_name() {
  return "penumbra " + std::string(version()) + " (engine " + std::string(short_engine_hash()) + ")";
}

}  // namespace penumbra::api
