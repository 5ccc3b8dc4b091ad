// The table `identity` of a run store: what a run was computed from.
#pragma once

#include "spartan/core/result.h"
#include "spartan/storage/database.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// Code `output`.
Status write_identity(Database& db, const RunIdentity& identity);
/// Code `store_damaged`.
Result<RunIdentity> read_identity(Database& db);
/// Code `configuration` where the stored run has another identity; the message names what differs.
Status expect_identity(Database& db, const RunIdentity& identity);

}  // namespace spartan::internal
