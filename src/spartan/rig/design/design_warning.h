// Where requirements and what meets them do not fit together.
#pragma once

#include <string>
#include <vector>

namespace spartan {

struct RigDesign;
struct RigRequirements;

/// One thing a person should know. `value` is the figure that `text` is about, in the unit that the text gives it.
struct DesignWarning {
  std::string id;  ///< docs/math/rig_design.md, "Warnings"
  std::string pair;
  std::string text;
  double value = 0;
};

/// Everything there is to say of a design; its own warnings do not count.
std::vector<DesignWarning> find_design_warnings(const RigRequirements& requirements, const RigDesign& design);

}  // namespace spartan
