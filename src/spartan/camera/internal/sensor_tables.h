// Sensor samples from CSV files, read row by row.
#pragma once

#include <functional>
#include <string>

#include "spartan/camera/internal/recording_index.h"
#include "spartan/camera/internal/table.h"

namespace spartan::internal {

/// Parses the fields of a row into a sample. An error describes the field; the caller adds file and line.
using RowReader = std::function<Result<Sample>(const std::vector<std::string_view>&)>;

/// Opens a stream over a table whose rows have at least `fields` fields. Rows that cannot be parsed are discarded and
/// counted. Codes as TableReader::open().
SensorStreamFactory stream_of_table(const std::string& path, const TableFormat& format, std::size_t fields,
                                    const RowReader& read_row);

/// IMU rows: stamp_ns, angular rate x y z (rad/s), specific force x y z (m/s²). `body_from_imu` rotates both into the
/// body frame.
RowReader read_imu_row(const Eigen::Quaterniond& body_from_imu);
/// Wheel rows: stamp_ns, left_m, right_m.
Result<Sample> read_wheel_row(const std::vector<std::string_view>& row);
/// Compass rows: stamp_ns, heading_rad, sigma_rad.
Result<Sample> read_compass_row(const std::vector<std::string_view>& row);
/// Inclinometer rows: stamp_ns, roll_rad, pitch_rad, sigma_rad.
Result<Sample> read_inclinometer_row(const std::vector<std::string_view>& row);

}  // namespace spartan::internal
