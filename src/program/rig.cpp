#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "program/json.h"
#include "program/rig_design.h"
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
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    return failure(ErrorCode::input, "no such file or folder", path, "a calibration file, or a folder that holds one");
  }
  const auto rig = read_rig(path);
  if (!rig) return failure(rig);
  std::string text;
  if (context.json) {
    text = to_json(*rig).dump(2) + "\n";
  } else {
    for (const std::string& sentence : describe_rig(*rig)) text += sentence + "\n";
  }
  if (Status printed = print(text); !printed) return failure(printed);
  return kDone;
}

}  // namespace

void add_rig(CLI::App& app, Context& context) {
  CLI::App* rig = app.add_subcommand("rig", "Calibrations and stereo pairs: what was understood, what to build");
  rig->require_subcommand(1);
  const auto path = std::make_shared<std::string>();
  CLI::App* verb =
      add_verb(*rig, context, "inspect", "Every camera, pair and transform of a calibration in words",
               "rig inspect $SPARTAN_DATA/kitti_06/calib.txt", [&context, path] { return inspect(context, *path); });
  verb->add_option("rig", *path, "rig.yaml, KITTI calib.txt or calib_cam_to_cam.txt, EuRoC sensor.yaml, OpenCV yml")
      ->required()
      ->option_text("RIG");
  add_json_flag(*verb, context);
  add_rig_design(*rig, context);
}

}  // namespace spartan::program
