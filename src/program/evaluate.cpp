// spartan evaluate: compares a trajectory with ground truth.
#include <fmt/format.h>

#include <memory>

#include "program/commands.h"
#include "program/trajectory_report.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/report/report.h"

namespace spartan::program {
namespace {

struct Arguments {
  std::string estimate, truth;
  std::string trajectory;
  std::string align = "se3";
  bool kitti = false;
  TrajectoryMetricsOptions options;
};

Result<ExitCode> evaluate(const Context& context, const Arguments& arguments) {
  const auto compared = find_trajectories(arguments.estimate, arguments.truth, arguments.trajectory);
  if (!compared) return failure(compared);
  TrajectoryMetricsOptions options = arguments.options;
  options.alignment = *alignment_named(arguments.align);
  if (arguments.kitti) options = with_kitti_segments(std::move(options));
  const auto scores = score(*compared, options);
  if (!scores) return failure(scores);
  const Status printed =
      print(context.json ? text_of(to_json(*scores, *compared)) + "\n" : table_of(*scores, *compared));
  if (!printed) return failure(printed);
  return kDone;
}

}  // namespace

void add_evaluate(CLI::App& app, Context& context) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      add_command(app, context, "evaluate", "Compare a trajectory with ground truth: ATE, RPE, drift, segment errors",
                  "evaluate run_06 --truth $SPARTAN_DATA/kitti_06 --align se3",
                  [&context, arguments] { return evaluate(context, *arguments); });
  command
      ->add_option("estimate", arguments->estimate,
                   "Estimated trajectory: a run folder, or a file (TUM, KITTI, EuRoC csv).")
      ->required()
      ->option_text("EST REQUIRED");
  command
      ->add_option("--truth", arguments->truth,
                   "Ground truth: a trajectory file (TUM, KITTI, EuRoC csv), or a recording that has one.")
      ->required()
      ->option_text("GT REQUIRED");
  command
      ->add_option("--align", arguments->align,
                   "Alignment of the estimate before comparing: none, first (first pose), yaw (yaw and translation), "
                   "se3 (default), "
                   "sim3 (with scale).")
      ->check(CLI::IsMember({"none", "first", "yaw", "se3", "sim3"}))
      ->option_text("HOW");
  command
      ->add_option(
          "--trajectory", arguments->trajectory,
          "Trajectory of the run folder: odometry, slam or localization (default: the last of these that exists), or "
          "smoothed.")
      ->check(CLI::IsMember({"odometry", "slam", "localization", "smoothed"}))
      ->option_text("WHICH");
  auto* segments = command
                       ->add_option("--segments", arguments->options.segment_lengths_m,
                                    "Lengths in metres of the segments over which relative errors are averaged "
                                    "(default: 1,2,5,10,20,40,100).")
                       ->delimiter(',')
                       ->check(positive_number())
                       ->option_text("M,M,…");
  command
      ->add_flag("--kitti", arguments->kitti,
                 "Use the segments of the KITTI benchmark: 100, 200 … 800 m, starting at every 10th frame.")
      ->excludes(segments);
  command
      ->add_option("--max-dt", arguments->options.max_dt_s,
                   "Maximum time difference in seconds of two poses that are compared (default 0.02).")
      ->check(non_negative_number())
      ->option_text("S");
  add_json_flag(*command, context);
}

}  // namespace spartan::program
