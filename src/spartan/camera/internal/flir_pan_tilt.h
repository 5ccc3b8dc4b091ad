// Pan-tilt units by FLIR and Directed Perception.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "spartan/camera/internal/serial_line.h"
#include "spartan/camera/sample_stream.h"

namespace spartan::internal {

struct FlirAddress {
  std::string device;
  int baud = 9600;
  int pan_sign = -1, tilt_sign = -1;     ///< of a position of the unit, for angles as in the rig
  double pan_deg_s = 0, tilt_deg_s = 0;  ///< speeds; 0: as the unit is set
};

/// Parses "DEVICE?baud=9600&pan=-1&tilt=-1&pan_deg_s=30&tilt_deg_s=15", all but the device optional. Code `usage`.
Result<FlirAddress> parse_flir_address(const std::string& text);

/// The ASCII protocol of the PTU-46, the D and the E series (FLIR, "E Series Pan-Tilt Command Reference Manual"): a
/// command is a name, a number and a delimiter, `PP-2500 `; the answer is a line `*`, a query's `* 22`, a refused one's
/// `! message`. A position is a whole number of steps, whose size the unit states in seconds of arc. Lines that are no
/// answers are ignored; where no answer comes, a command is sent again. A line that was unplugged is opened again by
/// the next motion.
///
/// The end of a motion is found by reading the positions (`PP`, `TP`), not by the await command `A`: that one is
/// answered at the end of the motion only, so that a unit which moves for seconds could not be told from one that is
/// silent, a loss of power would be noticed late, and no other motion could be commanded meanwhile.
class FlirPanTilt : public PanTiltControl {
 public:
  /// Codes: `read_error`, `usage` (SerialLine::open(); a speed beyond the limits of the unit).
  static Result<std::unique_ptr<PanTiltControl>> open(const FlirAddress& address);

  Status move_to(const PanTiltAngles& angles) override;
  Result<PanTiltReading> read() override;
  /// Of the rounding to steps.
  double sigma_rad() const override;

  static constexpr std::chrono::milliseconds kAnswerTime{500};
  static constexpr int kAttempts = 3;

 private:
  struct Axis {
    char name = 'P';  // 'T'
    int sign = -1;
    double deg_s = 0;  // 0: as the unit is set
    double step_rad = 0;
    long least = 0, most = 0, target = 0;  // positions
  };

  FlirPanTilt(SerialLine line, const FlirAddress& address)
      : line_(std::move(line)),
        baud_(address.baud),
        axes_{Axis{'P', address.pan_sign, address.pan_deg_s, 0, 0, 0, 0},
              Axis{'T', address.tilt_sign, address.tilt_deg_s, 0, 0, 0, 0}} {}

  Status connect();
  Status connect_axis(Axis& axis);
  Status set_speed(const Axis& axis);
  Result<std::string> ask(const std::string& text, bool wants_number);
  Status command(const std::string& text);
  Result<double> query(const std::string& text);
  Result<long> position_of(const Axis& axis, double angle_rad) const;

  SerialLine line_;
  int baud_;
  std::array<Axis, 2> axes_;
  bool connected_ = false;
};

}  // namespace spartan::internal
