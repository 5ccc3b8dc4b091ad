// Makes a short stereo drive with known poses: the recording that `make demo` runs on until there is a simulator.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "spartan/camera/recording_writer.h"
#include "spartan/core/random.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/synthetic_world.h"

namespace spartan {
namespace {

constexpr double kGravity_m_s2 = 9.81;
constexpr double kStep_m = 0.10;      // from frame to frame
constexpr double kArcRadius_m = 6.0;  // of the path, to the left
constexpr double kFramePeriod_s = 1.0;
constexpr double kRest_s = 2.0;  // standing before the first frame, so that gravity can be measured
constexpr double kImuRate_hz = 100;
constexpr double kWheelBase_m = 0.5, kTrack_m = 0.4;
const char* const kPair = "narrow";

struct Arguments {
  std::string folder;
  int frames = 40;
  std::uint64_t seed = 1;
  int threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
};

/// The narrow pair of the published rover: 0.30 m high, 31.55° down, 0.12 m baseline, 640 × 480 px, 66° wide.
Rig make_rig() {
  constexpr double kHeight_m = 0.30, kBaseline_m = 0.12, kTilt_rad = 31.55 * std::numbers::pi / 180;
  const double focal_px = 320 / std::tan(33 * std::numbers::pi / 180);
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(kTilt_rad, Eigen::Vector3d::UnitY()));
  const auto eye = [&](const std::string& name, double y_m) {
    Camera camera;
    camera.name = name;
    camera.size = {640, 480};
    camera.model = PinholeModel{focal_px, focal_px, 319.5, 239.5};
    camera.mount_from_camera =
        Pose(tilt * optical_from_forward().rotation().conjugate(), Eigen::Vector3d(0, y_m, kHeight_m));
    return camera;
  };
  Rig rig;
  rig.name = "synthetic_rover";
  rig.cameras = {eye("narrow_left", kBaseline_m / 2), eye("narrow_right", -kBaseline_m / 2)};
  rig.pairs = {{kPair, "narrow_left", "narrow_right", 0.3}};
  return rig;
}

testing::SyntheticWorld make_world(std::uint64_t seed) {
  testing::SyntheticWorldOptions options;
  options.seed = seed;
  options.relief_m = 0.035;
  options.relief_size_m = 1.8;
  options.stones_per_m2 = 7;
  options.stone_size_m = 0.16;
  return testing::SyntheticWorld(options);
}

/// The rover on its four wheels: ground_from_body at a place and heading.
Pose stand_on(const testing::SyntheticWorld& world, double x, double y, double heading_rad) {
  const Eigen::Vector3d ahead(std::cos(heading_rad), std::sin(heading_rad), 0);
  const Eigen::Vector3d aside(-ahead.y(), ahead.x(), 0);
  const auto wheel = [&](double forward, double left) {
    Eigen::Vector3d p = Eigen::Vector3d(x, y, 0) + forward * kWheelBase_m / 2 * ahead + left * kTrack_m / 2 * aside;
    p.z() = world.relief(p.x(), p.y());
    return p;
  };
  const Eigen::Vector3d front_left = wheel(1, 1), front_right = wheel(1, -1);
  const Eigen::Vector3d rear_left = wheel(-1, 1), rear_right = wheel(-1, -1);
  const Eigen::Vector3d up = (front_left + front_right - rear_left - rear_right)
                                 .cross(front_left + rear_left - front_right - rear_right)
                                 .normalized();
  Eigen::Matrix3d axes;
  axes.col(0) = (ahead - ahead.dot(up) * up).normalized();
  axes.col(1) = up.cross(axes.col(0));
  axes.col(2) = up;
  return {axes, (front_left + front_right + rear_left + rear_right) / 4};
}

/// Poses along a gentle arc in the ground's own frame.
std::vector<Pose> drive(const testing::SyntheticWorld& world, int frames) {
  std::vector<Pose> poses;
  for (int i = 0; i < frames; ++i) {
    const double heading = i * kStep_m / kArcRadius_m;
    poses.push_back(stand_on(world, kArcRadius_m * std::sin(heading), kArcRadius_m * (1 - std::cos(heading)), heading));
  }
  return poses;
}

/// The recording's world begins at the first body position, with x along the horizontal part of the camera's look.
Pose world_from_ground(const Pose& first_ground_from_body, const Rig& rig) {
  const Pose ground_from_camera = first_ground_from_body * rig.body_from_camera("narrow_left");
  const Eigen::Vector3d look = ground_from_camera.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::AngleAxisd turn(-std::atan2(look.y(), look.x()), Eigen::Vector3d::UnitZ());
  return Pose::from_rotation(Eigen::Quaterniond(turn)) * Pose::from_translation(-first_ground_from_body.translation());
}

Status write_rest(RecordingWriter& writer, const Pose& world_from_body, std::uint64_t seed) {
  Random random(seed, 7);
  const auto noise = [&](double sigma) -> Eigen::Vector3d {
    const double x = random.normal(0, sigma), y = random.normal(0, sigma), z = random.normal(0, sigma);
    return {x, y, z};
  };
  const Eigen::Vector3d up_in_body = world_from_body.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  for (int i = 0; i < static_cast<int>(kRest_s * kImuRate_hz); ++i) {
    const Stamp stamp = Stamp::from_seconds(i / kImuRate_hz);
    if (Status status = writer.add(ImuSample{stamp, noise(1e-3), kGravity_m_s2 * up_in_body + noise(0.02)}); !status) {
      return status;
    }
  }
  return {};
}

Stamp stamp_of_frame(int frame) {
  return Stamp::from_seconds(kRest_s + frame * kFramePeriod_s);
}

Status write_shot(RecordingWriter& writer, int frame, testing::SyntheticShot shot) {
  const Stamp stamp = stamp_of_frame(frame);
  Status status = writer.write_truth_disparity(kPair, stamp, shot.disparity, shot.mask);
  if (!status) return status;
  StereoFrame stereo;
  stereo.frame_id = frame;
  stereo.position_id = frame;
  stereo.pair = kPair;
  stereo.left_stamp = stereo.right_stamp = stamp;
  stereo.left = FrameImage::own(std::move(shot.left), {});
  stereo.right = FrameImage::own(std::move(shot.right), {});
  return writer.add(stereo);
}

Status synthesize(const Arguments& arguments) {
  const Rig rig = make_rig();
  const testing::SyntheticWorld world = make_world(arguments.seed);
  RecordingOptions options;
  options.name = "synthetic drive";
  options.description = "Rendered height field with stones, seen by the narrow pair of the published rover";
  options.gravity_m_s2 = kGravity_m_s2;
  auto writer = RecordingWriter::create(arguments.folder, rig, options);
  if (!writer) return failure(writer);

  const std::vector<Pose> ground_from_body = drive(world, arguments.frames);
  const Pose to_world = world_from_ground(ground_from_body.front(), rig);
  Trajectory truth;
  for (int i = 0; i < arguments.frames; ++i) {
    truth.push_back({stamp_of_frame(i), to_world * ground_from_body[static_cast<std::size_t>(i)]});
  }
  if (Status status = write_rest(*writer, truth.front().pose, arguments.seed); !status) return status;

  const Camera& left = *rig.find_camera("narrow_left");
  const PinholeModel& pinhole = std::get<PinholeModel>(left.model);
  const double baseline_m = rig.right_from_left(rig.pairs.front()).translation().norm();
  const RectifiedStereo stereo{left.size, pinhole.fx, {pinhole.cx, pinhole.cy}, baseline_m};
  const Workers workers(arguments.threads);
  const int batch = 2 * arguments.threads;  // rendered side by side, then written in order
  for (int begin = 0; begin < arguments.frames; begin += batch) {
    const int end = std::min(begin + batch, arguments.frames);
    std::vector<testing::SyntheticShot> shots(static_cast<std::size_t>(end - begin));
    workers.for_each_part(begin, end, 1, [&](int frame, int) {
      const Pose ground_from_left = ground_from_body[static_cast<std::size_t>(frame)] * left.mount_from_camera;
      shots[static_cast<std::size_t>(frame - begin)] =
          world.render(stereo, ground_from_left, arguments.seed * 100000 + static_cast<std::uint64_t>(frame));
    });
    for (int frame = begin; frame < end; ++frame) {
      Status status = write_shot(*writer, frame, std::move(shots[static_cast<std::size_t>(frame - begin)]));
      if (!status) return status;
    }
    fmt::print("{} of {} frames\n", end, arguments.frames);
    std::fflush(stdout);
  }
  if (Status status = writer->write_truth(rig, truth); !status) return status;
  return writer->finish();
}

int run(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"Synthesises a short stereo drive over stony ground as a Spartan recording with truth."};
  app.add_option("OUT_DIR", arguments.folder, "folder of the recording; must not hold anything")->required();
  app.add_option("--frames", arguments.frames, "stereo shots, 0.10 m apart")->check(CLI::Range(1, 100000));
  app.add_option("--seed", arguments.seed, "of the ground and the noise");
  app.add_option("--threads", arguments.threads, "threads to use")->check(CLI::Range(1, 1024));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (const Status status = synthesize(arguments); !status) {
    fmt::print(stderr, "synthesize_drive: {}\n", status.error().message());
    return status.error().code == ErrorCode::output ? 5 : 1;
  }
  return 0;
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  try {
    return spartan::run(argc, argv);
  } catch (const std::exception& fault) {
    std::fprintf(stderr, "synthesize_drive: %s\n", fault.what());
    return 1;
  }
}
