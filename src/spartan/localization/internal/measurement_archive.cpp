#include "spartan/localization/internal/measurement_archive.h"

namespace spartan::internal {
namespace {

void put_constraint(ArchiveWriter& out, const PoseConstraint& c) {
  out.put(c.world_from_body);
  out.put(c.information);
  out.put(c.map_covariance);
}

PoseConstraint get_constraint(ArchiveReader& in, Stamp stamp) {
  const Pose pose = in.get_pose();
  const Matrix6d information = in.get_matrix6();
  return {stamp, pose, information, in.get_matrix6()};
}

}  // namespace

void put_measurement(ArchiveWriter& out, const Measurement& m) {
  out.put(static_cast<std::uint8_t>(m.index()));
  out.put(stamp_of_measurement(m).ns);
  if (const auto* imu = std::get_if<ImuSample>(&m)) {
    out.put(imu->gyro_rad_s);
    out.put(imu->accel_m_s2);
  } else if (const auto* motion = std::get_if<RelativeMotion>(&m)) {
    out.put(motion->from.ns);
    out.put(motion->previous_from_current);
    out.put(motion->covariance);
    out.put(motion->measured);
    out.put(motion->keeps_reference);
    out.put(motion->lasting_sigma.has_value());
    if (motion->lasting_sigma) {
      for (const double sigma : *motion->lasting_sigma) out.put(sigma);
    }
    for (Eigen::Index i = 0; i < motion->by_calibration.size(); ++i) out.put(motion->by_calibration.data()[i]);
  } else if (const auto* wheels = std::get_if<WheelSample>(&m)) {
    out.put(wheels->left_m);
    out.put(wheels->right_m);
  } else if (const auto* compass = std::get_if<CompassSample>(&m)) {
    out.put(compass->heading_rad);
    out.put(compass->sigma_rad);
  } else if (const auto* tilt = std::get_if<InclinometerSample>(&m)) {
    out.put(tilt->roll_rad);
    out.put(tilt->pitch_rad);
    out.put(tilt->sigma_rad);
  } else if (const auto* constraint = std::get_if<PoseConstraint>(&m)) {
    put_constraint(out, *constraint);
  } else if (const auto* late = std::get_if<LateConstraint>(&m)) {
    out.put(late->at_frame.stamp.ns);
    put_constraint(out, late->at_frame);
  }
}

std::optional<Measurement> get_measurement(ArchiveReader& in) {
  const auto kind = in.get<std::uint8_t>();
  const Stamp stamp = in.get_stamp();
  switch (kind) {
    case 0: {
      const Eigen::Vector3d gyro = in.get_vector3();
      return ImuSample{stamp, gyro, in.get_vector3()};
    }
    case 1: {
      RelativeMotion motion;
      motion.to = stamp;
      motion.from = in.get_stamp();
      motion.previous_from_current = in.get_pose();
      motion.covariance = in.get_matrix6();
      motion.measured = in.get<bool>();
      motion.keeps_reference = in.get<bool>();
      if (in.get<bool>()) {
        motion.lasting_sigma.emplace();
        for (double& sigma : *motion.lasting_sigma) sigma = in.get_finite();
      }
      for (Eigen::Index i = 0; i < motion.by_calibration.size(); ++i) motion.by_calibration.data()[i] = in.get_finite();
      return motion;
    }
    case 2: {
      const auto left = in.get<double>();
      return WheelSample{stamp, left, in.get<double>()};
    }
    case 3: {
      const auto heading = in.get<double>();
      return CompassSample{stamp, heading, in.get<double>()};
    }
    case 4: {
      const auto roll = in.get<double>(), pitch = in.get<double>();
      return InclinometerSample{stamp, roll, pitch, in.get<double>()};
    }
    case 5:
      return get_constraint(in, stamp);
    case 6: {
      const Stamp frame = in.get_stamp();
      return LateConstraint{stamp, get_constraint(in, frame)};
    }
    default:
      return std::nullopt;
  }
}

}  // namespace spartan::internal
