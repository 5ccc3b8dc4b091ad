// Sensor samples from tables in text files, a row at a time.
#pragma once

#include <functional>
#include <string>

#include "spartan/camera/recording_index.h"
#include "spartan/camera/table.h"

namespace spartan {

/// Makes a sample of a row's fields; an error names what is wrong with them, without the place.
using RowReader = std::function<Result<Sample>(const std::vector<std::string_view>&)>;

/// A stream over a table whose rows have at least `fields` fields. Errors of a row name file and line.
OpenStream stream_of_table(const std::string& path, const TableFormat& format, std::size_t fields,
                           const RowReader& read_row);

/// Row readers of stamp_ns and numbers: gyro x y z (rad/s), specific force x y z (m/s²), both turned by
/// `body_from_imu`.
RowReader read_imu_row(const Eigen::Quaterniond& body_from_imu);
/// stamp_ns, left_m, right_m.
Result<Sample> read_wheel_row(const std::vector<std::string_view>& row);
/// stamp_ns, heading_rad, sigma_rad.
Result<Sample> read_compass_row(const std::vector<std::string_view>& row);
/// stamp_ns, roll_rad, pitch_rad, sigma_rad.
Result<Sample> read_inclinometer_row(const std::vector<std::string_view>& row);

}  // namespace spartan
