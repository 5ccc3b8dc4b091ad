#include <fmt/format.h>

#include <memory>

#include "program/json.h"
#include "program/rig_convert.h"
#include "program/verbs.h"
#include "spartan/rig/describe.h"
#include "spartan/rig/rig_files.h"

namespace spartan::program {
namespace {

Json to_json(const Rig& rig) {
  Json pairs = Json::object();
  for (const StereoPair& pair : rig.pairs) {
    const PairSummary summary = summarize_pair(rig, pair);
    pairs[pair.name] = {{"baseline_m", number(summary.baseline_m)},
                        {"focal_px", number(summary.focal_px)},
                        {"hfov_deg", number(summary.hfov_deg)},
                        {"vfov_deg", number(summary.vfov_deg)}};
  }
  return {{"schema", 1}, {"pairs", std::move(pairs)}};
}

Result<ExitCode> inspect(const Context& context, const std::string& path) {
  if (const Status there = calibration_is_there(path); !there) return failure(there);
  const auto read = read_calibration(path);
  if (!read) return failure(read);
  const Rig* rig = &read->rig;
  std::string text;
  if (context.json) {
    text = to_json(*rig).dump(2) + "\n";
  } else {
    for (const std::string& sentence : describe_rig(*rig)) text += sentence + "\n";
    for (const std::string& note : read->notes) text += note + "\n";
  }
  if (Status printed = print(text); !printed) return failure(printed);
  return kDone;
}

}  // namespace

void add_rig(CLI::App& app, Context& context) {
  CLI::App* rig = app.add_subcommand("rig", "Calibrations: say in words what was understood, convert");
  rig->require_subcommand(1);
  const auto path = std::make_shared<std::string>();
  CLI::App* verb =
      add_verb(*rig, context, "inspect", "Every camera, pair and transform of a calibration in words",
               "rig inspect $SPARTAN_DATA/kitti_06/calib.txt", [&context, path] { return inspect(context, *path); });
  verb->add_option("rig", *path, "any calibration: a file, LEFT,RIGHT, or a folder that holds one")
      ->required()
      ->option_text("RIG");
  add_json_flag(*verb, context);
  add_rig_convert(*rig, context);
}

}  // namespace spartan::program
