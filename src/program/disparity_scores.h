// The scores of a disparity image as the program prints them.
#pragma once

#include <string>

#include "program/json.h"
#include "spartan/eval/disparity_metrics.h"

namespace spartan::program {

/// "scores" in docs/reference/json.md. Without a mask `nonocc` is null and `reasons` says so.
Json to_json(const DisparityMetrics& metrics);
/// The same for people, one column a kind of pixels.
std::string table_of(const DisparityMetrics& metrics);

}  // namespace spartan::program
