// CSV tables of IMU, wheel odometry, compass and inclinometer.
#include <cstdint>
#include <variant>

#include "input_file.h"
#include "spartan/camera/internal/sensor_tables.h"

using namespace spartan::internal;

namespace {

void read_all(const SensorStreamFactory& open) {
  const auto stream = open();
  if (!stream) return;
  for (;;) {
    const auto sample = (*stream)->next();
    if (!sample || !*sample) return;
    if (const auto* imu = std::get_if<spartan::ImuSample>(&**sample)) {
      if (!imu->gyro_rad_s.allFinite() || !imu->accel_m_s2.allFinite()) __builtin_trap();
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const spartan::testing::InputFile input(data, size);
  const TableFormat format{.separator = ',', .header = {}, .ends_with_newline = true};
  read_all(stream_of_table(input.path(), format, 7, read_imu_row(Eigen::Quaterniond::Identity())));
  read_all(stream_of_table(input.path(), format, 3, read_wheel_row));
  read_all(stream_of_table(input.path(), format, 3, read_compass_row));
  read_all(stream_of_table(input.path(), {.separator = ' ', .header = {}, .ends_with_newline = false}, 4,
                           read_inclinometer_row));
  return 0;
}
