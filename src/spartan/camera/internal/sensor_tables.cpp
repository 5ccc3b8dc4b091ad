#include "spartan/camera/internal/sensor_tables.h"

#include <fmt/format.h>

#include <array>

namespace spartan::internal {
namespace {

class TableStream : public SensorStream {
 public:
  TableStream(TableReader table, std::size_t fields, RowReader read_row)
      : table_(std::move(table)), fields_(fields), read_row_(std::move(read_row)) {}

  Result<std::optional<Sample>> next() override {
    for (;;) {
      const auto row = table_.next(fields_);
      if (!row && row.error().code != ErrorCode::input) return failure(row);
      if (!row) {
        leave_out(row.error().message());
        continue;
      }
      if (!*row) return std::nullopt;
      auto sample = read_row_(**row);
      if (sample) return std::move(*sample);
      leave_out(table_.error_in_row(sample.error().what).value().message());
    }
  }

  DiscardedSamples discarded() const override { return discarded_; }

 private:
  void leave_out(const std::string& fault) {
    if (++discarded_.unreadable == 1) discarded_.first_unreadable = fault;
  }

  TableReader table_;
  std::size_t fields_;
  RowReader read_row_;
  DiscardedSamples discarded_;
};

Result<Stamp> stamp_field(std::string_view text) {
  const auto stamp = parse_stamp_ns(text);
  if (!stamp) return failure(ErrorCode::input, fmt::format("'{}' is not a time in nanoseconds", text.substr(0, 40)));
  return *stamp;
}

// Parses fields 1 … Count as numbers.
template <std::size_t Count>
Result<std::array<double, Count>> numbers(const std::vector<std::string_view>& row) {
  std::array<double, Count> values{};
  for (std::size_t i = 0; i < Count; ++i) {
    const auto value = parse_number<double>(row[i + 1]);
    if (!value) return failure(ErrorCode::input, fmt::format("'{}' is not a finite number", row[i + 1].substr(0, 40)));
    values[i] = *value;
  }
  return values;
}

// Parses the stamp and `Count` numbers of a row; `make` builds the sample.
template <std::size_t Count, class Make>
Result<Sample> read_row(const std::vector<std::string_view>& row, Make make) {
  const auto stamp = stamp_field(row[0]);
  if (!stamp) return failure(stamp);
  const auto values = numbers<Count>(row);
  if (!values) return failure(values);
  return Sample(make(*stamp, *values));
}

}  // namespace

SensorStreamFactory stream_of_table(const std::string& path, const TableFormat& format, std::size_t fields,
                                    const RowReader& read_row) {
  return [=]() -> Result<std::unique_ptr<SensorStream>> {
    auto table = TableReader::open(path, format);
    if (!table) return failure(table);
    return std::make_unique<TableStream>(std::move(*table), fields, read_row);
  };
}

RowReader read_imu_row(const Eigen::Quaterniond& body_from_imu) {
  return [body_from_imu](const std::vector<std::string_view>& row) {
    return read_row<6>(row, [&](Stamp stamp, const std::array<double, 6>& v) {
      return ImuSample{stamp, body_from_imu * Eigen::Vector3d(v[0], v[1], v[2]),
                       body_from_imu * Eigen::Vector3d(v[3], v[4], v[5])};
    });
  };
}

Result<Sample> read_wheel_row(const std::vector<std::string_view>& row) {
  return read_row<2>(row, [](Stamp stamp, const auto& v) { return WheelSample{stamp, v[0], v[1]}; });
}
Result<Sample> read_compass_row(const std::vector<std::string_view>& row) {
  return read_row<2>(row, [](Stamp stamp, const auto& v) { return CompassSample{stamp, v[0], v[1]}; });
}
Result<Sample> read_inclinometer_row(const std::vector<std::string_view>& row) {
  return read_row<3>(row, [](Stamp stamp, const auto& v) { return InclinometerSample{stamp, v[0], v[1], v[2]}; });
}

}  // namespace spartan::internal
