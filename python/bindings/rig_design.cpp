#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <string>

#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/path_text.h"
#include "program/design_report.h"
#include "spartan/rig_design/rig_designer.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

nb::dict design(const PathText& requirements, bool whole_set) {
  std::string text;
  {
    const nb::gil_scoped_release free;
    const RigRequirements required = value_of(read_requirements(requirements));
    check(program::write_design_json(design_rig(required), whole_set, [&](const std::string& piece) {
      text += piece;
      return Status();
    }));
  }
  return nb::cast<nb::dict>(nb::module_::import_("json").attr("loads")(text));
}

}  // namespace

void bind_rig_design(nb::module_& m) {
  m.def(
      "design_rig", design, "requirements"_a, nb::kw_only(), "whole_set"_a = false,
      nb::sig(
          "def design_rig(requirements: str | os.PathLike[str], *, whole_set: bool = False) -> dict[str, typing.Any]"),
      "Searches the stereo pairs that meet a rover's requirements (docs/reference/requirements.md). Returns what "
      "`spartan "
      "rig design --json` prints (docs/reference/json.md); `whole_set`: also every feasible combination of each pair.");
}

}  // namespace spartan::python
