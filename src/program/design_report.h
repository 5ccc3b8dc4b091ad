// A rig design as JSON, CSV and text.
#pragma once

#include <functional>
#include <string>

#include "spartan/core/result.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan::program {

/// `rows` of each pair's feasible set are listed.
std::string design_text(const RigRequirements& requirements, const RigDesign& design, std::size_t rows);
/// docs/reference/json.md, handed over in pieces: a feasible set is never held as text, however long it is. With
/// `whole_set` each pair also holds its `feasible` set, the best first. Ends with the first piece that is refused.
Status write_design_json(const RigDesign& design, bool whole_set,
                         const std::function<Status(const std::string&)>& write);
/// The feasible sets of all pairs, the best of each first.
std::string design_csv(const RigDesign& design);

}  // namespace spartan::program
