#include "program/verbs.h"

namespace spartan::program {
namespace {

struct EvaluateArguments {
  std::string estimate, truth;
};

Result<ExitCode> evaluate(const Context&, const EvaluateArguments&) {
  return failure(ErrorCode::internal, "not built yet", "evaluate");
}

}  // namespace

void add_evaluate(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* verb = add_verb(app, context, "evaluate", "Compare a trajectory with the truth",
                            "evaluate run_06 --truth $SPARTAN_DATA/kitti_06 --align se3",
                            [&context, arguments] { return evaluate(context, *arguments); });
  verb->add_option("estimate", arguments->estimate, "a run folder or a trajectory file")->required();
  verb->add_option("--truth", arguments->truth, "a trajectory file or a recording with truth")->required();
  add_json_flag(*verb, context);
}

}  // namespace spartan::program
