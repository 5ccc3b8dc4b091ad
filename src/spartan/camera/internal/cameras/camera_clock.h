// The clock of a camera mapped to that of the host.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "spartan/core/time.h"

namespace spartan::internal {

/// A stamp of a camera on the host's clock.
struct MappedStamp {
  Stamp host;
  double sigma_s = 0;    ///< standard deviation, the unknown smallest delay of an arrival included
  bool trusted = false;  ///< false: the stamp of the camera is wrong, and `host` follows from the arrival alone
};

/// host = offset + rate · camera, fitted to the stamps of a camera and the times at which the host noticed them. These
/// times are late by delays that are never negative, so the line follows the earliest arrivals: of each kBin_s of the
/// last kWindow_s the one with the smallest delay; the rate is the median of the slopes between all pairs of them
/// (Theil, "A rank-invariant method of linear and polynomial regression analysis", 1950; Sen 1968), the offset the
/// median of what remains. Clocks of different rates have been mapped by the convex hull of the same points (Harrison,
/// Newman: "TICSync", ICRA 2011), which one wrong stamp would spoil.
///
/// A stamp is wrong where it does not increase, or the image would have been much less late than all before. Where
/// kRestarts of them agree with each other, the camera has set its clock, and the fit starts again with them. It does
/// also where kLateInRow images in a row, over kLate_s at least, were much later than the line and all by as much: the
/// camera has set its clock back. Those that waited together for a busy computer differ in how late they are.
class CameraClock {
 public:
  /// Of images in order of arrival. `camera_ns`: stamp of the camera; `noticed`: when the host had it.
  MappedStamp add(std::int64_t camera_ns, Stamp noticed);

  double rate() const { return 1 + rate_minus_1_; }  ///< seconds of the host in one of the camera
  double sigma_s() const { return sigma_s_; }        ///< of the newest stamp; 0 before the first one
  std::int64_t restarts() const { return restarts_; }

  static constexpr double kBin_s = 0.5, kWindow_s = 60;
  static constexpr double kLeastSpan_s = 10;         ///< of the fit of a rate; a shorter one takes 1
  static constexpr double kLargestRate = 5e-4;       ///< of rate() − 1; that of a crystal is a tenth
  static constexpr double kLeastTolerance_s = 0.02;  ///< by which an arrival may be earlier than all before
  static constexpr std::size_t kRestarts = 3, kLateInRow = 15;
  static constexpr double kLate_s = 1;
  static constexpr double kFirstSigma_s = 0.03;  ///< of the smallest delay by one arrival; of more, over their number

 private:
  struct Point {
    std::int64_t camera_ns = 0, host_ns = 0;
  };
  // The earliest arrival of a bin, and by how much an ordinary one was later.
  struct Bin {
    std::int64_t number = 0;
    Point earliest;
    std::vector<double> delays_s;
  };

  double delay_of(const Point& point) const;
  double tolerance_s() const;
  bool is_wrong(const Point& point) const;
  bool was_set_back(const Point& point);
  void start_again(std::deque<Point>& points);
  MappedStamp without_clock(const Point& point) const;
  bool agrees(const Point& point) const;
  void restart(const Point& point);
  void insert(const Point& point);
  void fit_rate();
  void fit_offset();

  std::deque<Bin> bins_;
  std::deque<Point> refused_;  // the newest wrong ones, one after the other
  std::deque<Point> late_;     // the newest ones, much later than the line
  std::optional<std::int64_t> last_camera_ns_;
  Point origin_;  // of the line
  double offset_s_ = 0, rate_minus_1_ = 0;
  double typical_delay_s_ = 0, scatter_s_ = 0, first_sigma_s_ = 0, sigma_s_ = 0;
  std::int64_t restarts_ = 0;
};

}  // namespace spartan::internal
