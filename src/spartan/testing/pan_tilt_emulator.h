// An emulated pan-tilt unit on a pseudo terminal, for tests.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <mutex>
#include <string>
#include <thread>

namespace spartan::testing {

/// Answers the ASCII protocol of a FLIR PTU-46 as its manual describes it, with faults on request. Positions count to
/// the right and upwards.
class PanTiltEmulator {
 public:
  /// Steps of 185.1428" as the PTU-46; positions ±3090 (pan) and −907 … 604 (tilt); speeds that can be set from
  /// kSlowest to kFastest. `steps_per_second`: of an axis whose speed was not set; not limited, so that tests need not
  /// wait.
  explicit PanTiltEmulator(double steps_per_second = 20000);
  ~PanTiltEmulator();
  PanTiltEmulator(const PanTiltEmulator&) = delete;
  PanTiltEmulator& operator=(const PanTiltEmulator&) = delete;

  /// The device to open.
  const std::string& device() const { return device_; }
  double position(char axis) const;  ///< 'P' or 'T'; steps
  double speed(char axis) const;     ///< steps per second

  /// The next `n` commands get no answer.
  void ignore(int n) { ignored_ = n; }
  /// Sends bytes that are no answer before each of the next `n` answers.
  void send_garbage(int n) { garbage_ = n; }
  /// The next command is refused with this message.
  void refuse(const std::string& message);
  /// As after a loss of power: position 0, echo and verbose answers, and a banner. Until then it is silent.
  void lose_power(std::chrono::milliseconds silent);

  static constexpr double kStep_arcsec = 185.1428;
  static constexpr long kSlowest = 31, kFastest = 2902;  // steps per second

 private:
  struct Axis {
    double position = 0;
    long target = 0, least = 0, most = 0;
    double speed = 0;
  };
  void run();
  void receive(char c);
  void execute(const std::string& command);
  std::string answer_to(const std::string& command);
  std::string execute_on(char name, char what, const std::string& number);
  std::string query_result(const Axis& axis, const std::string& name) const;
  void move();
  void send(const std::string& text) const;

  int master_ = -1;
  std::string device_;
  double own_speed_;  // steps per second
  mutable std::mutex mutex_;
  std::array<Axis, 2> axes_;
  bool echo_ = true, verbose_ = true;
  std::string command_, refusal_;
  std::chrono::steady_clock::time_point moved_, silent_until_;
  bool boots_ = false;
  std::atomic<int> ignored_ = 0, garbage_ = 0;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

}  // namespace spartan::testing
