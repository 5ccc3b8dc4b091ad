// spartan evaluate: compares a trajectory with the truth.
#include <fmt/format.h>

#include <memory>

#include "program/compared_trajectories.h"
#include "program/trajectory_report.h"
#include "program/verbs.h"
#include "spartan/eval/trajectory_metrics.h"

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
  if (arguments.kitti) use_kitti_segments(options);
  const auto metrics = compare_trajectories(compared->estimate, compared->truth, options);
  if (!metrics) return failure(metrics);
  const Status printed =
      print(context.json ? to_json(*metrics, *compared).dump(2) + "\n" : table_of(*metrics, *compared));
  if (!printed) return failure(printed);
  return kDone;
}

}  // namespace

void add_evaluate(CLI::App& app, Context& context) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = add_verb(app, context, "evaluate", "Compare a trajectory with the truth",
                            "evaluate run_06 --truth $SPARTAN_DATA/kitti_06 --align se3",
                            [&context, arguments] { return evaluate(context, *arguments); });
  verb->add_option("estimate", arguments->estimate, "a run folder or a trajectory file")
      ->required()
      ->option_text("EST");
  verb->add_option("--truth", arguments->truth, "a trajectory file (TUM, KITTI, EuRoC csv) or a recording with truth")
      ->required()
      ->option_text("GT");
  verb->add_option("--align", arguments->align,
                   "what is fitted before comparing: none, first, yaw, se3 (default), sim3")
      ->check(CLI::IsMember({"none", "first", "yaw", "se3", "sim3"}))
      ->option_text("HOW");
  verb->add_option("--trajectory", arguments->trajectory,
                   "which one of a run: odometry, slam or localization (default: the best there is)")
      ->check(CLI::IsMember({"odometry", "slam", "localization"}))
      ->option_text("WHICH");
  auto* segments = verb->add_option("--segments", arguments->options.segment_lengths_m,
                                    "lengths in metres, as 5,10,20 (default: 1,2,5,10,20,40,100)")
                       ->delimiter(',')
                       ->check(CLI::PositiveNumber)
                       ->option_text("M,M,…");
  verb->add_flag("--kitti", arguments->kitti, "segments of 100, 200 … 800 m from every 10th frame")->excludes(segments);
  verb->add_option("--max-dt", arguments->options.max_dt_s, "largest time between poses that are compared, s (0.02)")
      ->check(CLI::NonNegativeNumber)
      ->option_text("S");
  add_json_flag(*verb, context);
}

}  // namespace spartan::program
