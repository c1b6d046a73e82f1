#pragma once
#include <string>

#include "server/store/job_store.h"
#include "server/store/sqlite.h"

namespace penumbra::store {

/// A job that the server has died of so often is not tried again.
inline constexpr int most_crashes = 3;

/// Reads every page of the database. Throws std::runtime_error when one is not as it should be.
void check_pages(Database& database);

/// Jobs that were running are queued again, or have failed when the server has died of them too often. Images that
/// another engine version rendered are no longer found again.
void recover(Database& database, const std::string& engine_version, Time now);

}  // namespace penumbra::store
