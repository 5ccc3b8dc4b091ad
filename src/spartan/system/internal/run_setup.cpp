#include "spartan/system/internal/run_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/core/pose.h"
#include "spartan/system/internal/map_scale.h"
#include "spartan/system/internal/row_alignment.h"
#include "spartan/system/run_folder.h"

namespace spartan::internal {
namespace {

// Whether a pair has frames, or will have: a camera that runs now may answer later.
bool has_frames(const SampleStream& source, const StereoPair& pair, Pace pace) {
  const bool is_of_cameras = pace == Pace::live && !source.is_repeatable();
  return source.previews(pair.name) > 0 ||
         (is_of_cameras && source.info().rig.find_camera(pair.left)->driver.has_value());
}

// Stops need frames of another pair than that of the odometry.
MapSource map_source(const SampleStream& source, const RunOptions& options, Pace pace) {
  const Rig& rig = source.info().rig;
  const StereoPair* const odometry = odometry_pair_of(rig, options);
  if (options.maps_from != MapSource::automatic || odometry == nullptr) return options.maps_from;
  const bool stops = std::any_of(rig.pairs.begin(), rig.pairs.end(), [&](const StereoPair& pair) {
    return pair.name != odometry->name && has_frames(source, pair, pace);
  });
  return stops ? MapSource::stops : MapSource::keyframes;
}

RunOptions options_of(const SampleStream& source, const RunRequest& request, Pace pace) {
  const StreamInfo& info = source.info();
  RunOptions options = request.options;
  options.maps_from = map_source(source, options, pace);
  if (options.gravity_m_s2 == 0) options.gravity_m_s2 = info.gravity_m_s2.value_or(0);
  if (options.use_specified_noise) {
    options.localization =
        with_specified_noise(options.localization, info.noise, request.given.in_group("localization"));
  }
  return options;
}

// "z is the normal of the ground in the first images (body pitched 33.6 deg down, rolled 2.8 deg to the left)"
std::string level_text(const Eigen::Vector3d& up_in_body) {
  const double pitch = std::atan2(-up_in_body.x(), std::hypot(up_in_body.y(), up_in_body.z())) / kRadiansPerDegree,
               roll = std::atan2(up_in_body.y(), up_in_body.z()) / kRadiansPerDegree;
  return fmt::format(
      "z is the normal of the ground in the first images (body pitched {:.1f} deg {}, rolled {:.1f} deg "
      "to the {})",
      std::abs(pitch), pitch >= 0 ? "down" : "up", std::abs(roll), roll >= 0 ? "right" : "left");
}

// Damaged, or of another version.
tl::unexpected<Error> unreadable_identity(const std::string& store, const Error& error) {
  return failure(ErrorCode::configuration, "has a rig or options that this version cannot read: " + error.what, store,
                 "run again into a new folder");
}

// As before the run was interrupted.
Result<RunSetup> set_up_again(const RunIdentity& before, const std::string& mask_folder, const std::string& store,
                              const ThreadPool& workers) {
  auto rig = parse_rig_yaml(before.rig, store);
  if (!rig) return unreadable_identity(store, rig.error());
  auto options = parse_options<RunOptions>(before.options, store);
  if (!options) return unreadable_identity(store, options.error());
  auto pipeline = Pipeline::create(*rig, *options, workers, mask_folder, Pace::live);
  if (!pipeline) return failure(pipeline);
  if (before.ground_up) pipeline->align_with_ground(*before.ground_up);
  return RunSetup{std::move(*rig), std::move(*options), std::move(*pipeline), before.ground_up, {}};
}

}  // namespace

Result<RunSetup> set_up_run(SampleStream& source, const RunRequest& request, const ThreadPool& workers, Pace pace,
                            const RunIdentity* before) {
  const StreamInfo& info = source.info();
  const std::string mask_folder = info.mask_folder();
  RunOptions options = options_of(source, request, pace);
  auto pipeline = Pipeline::create(info.rig, options, workers, mask_folder, pace);
  if (!pipeline) return failure(pipeline);
  if (Status fits = pipeline->check_memory(request.memory_bytes); !fits) return failure(fits);
  if (Status usable = check_run_folder({request.output}, request.resume || request.replace); !usable)
    return failure(usable);
  if (before != nullptr) return set_up_again(*before, mask_folder, RunFolder{request.output}.store(), workers);

  AlignedRig aligned{info.rig, {}};
  if (options.align_rows && options.imaging.rectify) {
    auto found = align_rows_of(source, workers);
    if (!found) return failure(found);
    aligned = std::move(*found);
  }
  std::optional<Eigen::Vector3d> ground_up;
  const bool makes_maps = options.maps && !options.odometry_only;
  // A camera without a body frame and an IMU: its axes do not tell where up is. The odometry alone computes no
  // disparity image.
  const bool unknown_up =
      aligned.rig.convention == PoseConvention::left_optical && !info.has_imu && !options.odometry_only;
  if (makes_maps || unknown_up) {
    const auto scale = map_scale_of(source, aligned.rig, options, workers, mask_folder);
    if (!scale) return failure(scale);
    if (makes_maps) {
      options = with_map_scale(options, *scale, request.given);
      aligned.sentences.push_back("local maps: " + to_text(*scale, options));
    }
    if (unknown_up) ground_up = scale->up_in_body;
  }
  if (!aligned.sentences.empty()) pipeline = Pipeline::create(aligned.rig, options, workers, mask_folder, pace);
  if (!pipeline) return failure(pipeline);
  if (ground_up) {
    pipeline->align_with_ground(*ground_up);
    aligned.sentences.push_back("world: " + level_text(*ground_up));
  }
  return RunSetup{std::move(aligned.rig), std::move(options), std::move(*pipeline), ground_up,
                  std::move(aligned.sentences)};
}

}  // namespace spartan::internal
