// Typical IMUs.
#include "spartan/sim/sensor_options.h"

namespace spartan::sim {

// Orders of magnitude of data sheets: tactical grade of 1 deg/h and 0.1 mg, industrial modules of 10 deg/h and 0.5 mg,
// consumer MEMS of 0.5 deg/s and 5 mg before calibration.
ImuOptions imu_of_grade(ImuGrade grade) {
  ImuOptions imu;
  imu.grade = grade;
  switch (grade) {
    case ImuGrade::given:
    case ImuGrade::industrial:
      break;
    case ImuGrade::tactical:
      imu.gyro_noise_rad_s_sqrt_hz = 2e-5;
      imu.gyro_bias_rad_s = 5e-6;
      imu.gyro_walk_rad_s2_sqrt_hz = 1e-7;
      imu.accel_noise_m_s2_sqrt_hz = 3e-4;
      imu.accel_bias_m_s2 = 1e-3;
      imu.accel_walk_m_s3_sqrt_hz = 1e-5;
      break;
    case ImuGrade::mems:
      imu.gyro_noise_rad_s_sqrt_hz = 3e-4;
      imu.gyro_bias_rad_s = 8.7e-3;
      imu.gyro_walk_rad_s2_sqrt_hz = 3e-5;
      imu.accel_noise_m_s2_sqrt_hz = 2e-3;
      imu.accel_bias_m_s2 = 0.05;
      imu.accel_walk_m_s3_sqrt_hz = 5e-4;
      break;
  }
  if (grade == ImuGrade::given) return imu;
  const bool mems = grade == ImuGrade::mems, tactical = grade == ImuGrade::tactical;
  imu.scale_percent = mems ? 1 : tactical ? 0.03 : 0.1;
  imu.misalignment_deg = mems ? 0.5 : tactical ? 0.02 : 0.05;
  imu.gyro_step_rad_s = mems ? 2.7e-4 : 0;  // 16 bits over ± 500 deg/s
  imu.accel_step_m_s2 = mems ? 1.2e-3 : 0;  // 16 bits over ± 4 g
  imu.gyro_vibration_rad_m = mems ? 0.3 : 0.1;
  imu.accel_vibration_1_s = 5;
  imu.delay_ms = mems ? 5 : 1;
  return imu;
}

}  // namespace spartan::sim
