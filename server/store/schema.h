#pragma once
#include "server/store/sqlite.h"

namespace penumbra::store {

/// Makes the tables of an empty database; checks those of one that has some, and brings those of an earlier version to
/// this one's. Throws std::runtime_error when they are
/// another program's, a newer version's, or not what this one made.
void prepare_schema(Database& database);

}  // namespace penumbra::store
