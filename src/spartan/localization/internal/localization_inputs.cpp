#include "spartan/localization/internal/localization_inputs.h"

#include "spartan/localization/internal/measurement_archive.h"

namespace spartan::internal {
namespace {

constexpr std::uint32_t kVersion = 1;

}  // namespace

Bytes LocalizationInputs::bytes() const {
  ArchiveWriter out;
  out.put(kVersion);
  out.put(start.has_value());
  if (start) {
    out.put(start->stamp.ns);
    out.put(start->ahead_in_body);
    out.put(start->up_in_body.has_value());
    out.put(start->up_in_body.value_or(Eigen::Vector3d::Zero()));
    out.put(start->assumed_up_in_body);
  }
  out.put(static_cast<std::uint64_t>(measurements.size()));
  for (const Measurement& m : measurements) put_measurement(out, m);
  return out.take();
}

Result<LocalizationInputs> parse_localization_inputs(const Bytes& bytes) {
  const std::string what = "inputs of the localization";
  ArchiveReader in(bytes);
  if (Status s = in.expect_version(kVersion, what); !s) return failure(s);
  LocalizationInputs inputs;
  if (in.get<bool>()) {
    LocalizationStart& start = inputs.start.emplace();
    start.stamp = in.get_stamp();
    start.ahead_in_body = in.get_vector3();
    const bool has_up = in.get<bool>();
    start.up_in_body = in.get_vector3();
    if (!has_up) start.up_in_body.reset();
    start.assumed_up_in_body = in.get_vector3();
  }
  const auto count = in.get<std::uint64_t>();
  for (std::uint64_t i = 0; i < count && in.ok(); ++i) {
    const auto m = get_measurement(in);
    if (!m || !is_valid(*m)) return failure(ErrorCode::store_damaged, "are damaged", what);
    inputs.measurements.push_back(*m);
  }
  if (Status s = in.finish(what); !s) return failure(s);
  return inputs;
}

}  // namespace spartan::internal
