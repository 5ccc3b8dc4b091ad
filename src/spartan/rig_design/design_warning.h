// Warnings about inconsistencies between requirements, published pair and search result.
#pragma once

#include <string>
#include <vector>

namespace spartan {

struct RigDesign;
struct RigRequirements;

/// One warning. `value` is the quantity that `text` reports, in the unit of the text.
struct DesignWarning {
  std::string id;  ///< docs/math/rig_design.md, "Warnings"
  std::string pair;
  std::string text;
  double value = 0;
};

/// All warnings about a design; ignores the field `warnings` of `design`.
std::vector<DesignWarning> find_design_warnings(const RigRequirements& requirements, const RigDesign& design);

}  // namespace spartan
