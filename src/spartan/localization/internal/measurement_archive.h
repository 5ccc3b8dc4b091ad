// Measurements as bytes.
#pragma once

#include <optional>

#include "spartan/core/archive.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

/// The index of the kind in the variant, then the fields.
void put_measurement(ArchiveWriter& out, const Measurement& m);
/// std::nullopt for an unknown kind; other errors are those of the reader.
std::optional<Measurement> get_measurement(ArchiveReader& in);

}  // namespace spartan::internal
