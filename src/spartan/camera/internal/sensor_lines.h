// Sensor samples that the rover's computer sends as lines of text.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "spartan/camera/internal/sensor_tables.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/core/time.h"

namespace spartan::internal {

/// Lines `SENSOR,STAMP,VALUES`: the name of a sensor and a row of its table in a recording (sensor_tables.h): `imu`,
/// `wheels`, `compass`, `inclinometer`. STAMP: nanoseconds since the epoch by the system's clock, or empty for the time
/// at which the line arrives. Lines that cannot be parsed, or whose stamp is not after that of the line before of this
/// sensor, more than kAhead_s after their arrival or more than kLate_s before it, are discarded and counted.
class SensorLines {
 public:
  /// `name`: where the lines come from, in messages. `body_from_imu` as read_imu_row().
  SensorLines(std::string name, const Eigen::Quaterniond& body_from_imu);

  /// When bytes have arrived, by the host's clock, which stamps of images are on, and by that of the system, which may
  /// have been set since.
  struct Arrival {
    Stamp host, system;
  };
  /// Takes bytes that have arrived: parts of lines, too.
  void add(std::string_view bytes, const Arrival& arrival);
  /// The next sample, on the host's clock; none where all were taken.
  std::optional<Sample> take();
  const DiscardedSamples& discarded() const { return discarded_; }

  static constexpr std::size_t kLongestLine = 1000;    ///< bytes
  static constexpr std::size_t kMostWaiting = 20'000;  ///< samples; beyond it the oldest one is discarded
  static constexpr double kAhead_s = 1;
  static constexpr double kLate_s = 60;  ///< lines wait while a run is prepared

 private:
  struct Sensor {
    std::string_view name;
    std::size_t fields;  // of a row: the stamp and its values
    RowReader read_row;
    std::optional<Stamp> last{};
  };

  void add_line(std::string_view line, const Arrival& arrival);
  Result<Sample> sample_of(const Sensor& sensor, std::vector<std::string_view> row, const Arrival& arrival) const;
  void discard(std::string_view line, const std::string& why);

  std::string name_;
  std::array<Sensor, 4> sensors_;
  std::string received_;      // a line whose end has not arrived
  bool is_too_long_ = false;  // the line before the next newline
  std::deque<Sample> samples_;
  DiscardedSamples discarded_;
};

}  // namespace spartan::internal
