// The native calibration format rig.yaml (docs/reference/rig.md).
#pragma once

#include <string>

#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// Reads a rig.yaml into a validated rig. Code `configuration` if the file cannot be read or is invalid; the error
/// lists all errors of the file, each with its line and key.
Result<Rig> read_rig_yaml(const std::string& path);
/// The same from memory; `name` is the name of the file in errors.
Result<Rig> parse_rig_yaml(const std::string& text, const std::string& name);
/// The rig as rig.yaml; parse_rig_yaml() restores it bit for bit.
std::string to_rig_yaml(const Rig& rig);

}  // namespace spartan
