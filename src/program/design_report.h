// A rig design in words, as JSON and as a table.
#pragma once

#include <string>

#include "program/json.h"
#include "spartan/rig/rig_designer.h"

namespace spartan::program {

/// `rows` of each pair's feasible set are listed.
std::string design_text(const RigRequirements& requirements, const RigDesign& design, std::size_t rows);
/// docs/formats.md, "JSON". With `whole_set` each pair also holds its `feasible` set, the best first.
Json design_json(const RigDesign& design, bool whole_set);
/// The feasible sets of all pairs, the best of each first.
std::string design_csv(const RigDesign& design);

}  // namespace spartan::program
