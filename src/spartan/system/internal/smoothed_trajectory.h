// The trajectory of a finished run by all its measurements.
#pragma once

#include "spartan/core/log.h"
#include "spartan/core/result.h"
#include "spartan/localization/localization_options.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// Smooths the localization from the inputs in the store and writes FrameRecord::smoothed. Does nothing where the store
/// has no inputs from the start on (a run that an older version of the program began). Codes: those of
/// RunStore::commit_smoothed and RunStore::frames.
Status write_smoothed_trajectory(RunStore& store, const LocalizationOptions& options, const Log& log);

}  // namespace spartan::internal
