#include "spartan/camera/internal/cameras/camera_clock.h"

#include <algorithm>
#include <cmath>

namespace spartan::internal {
namespace {

// For normally distributed values, standard deviation over median absolute deviation.
constexpr double kSigmaOfMad = 1.4826;

// The fit is used at the end of its window, where its variance is four times that in the middle.
constexpr double kAtTheEnd = 2;

double middle_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), half, values.end());
  return *half;
}

double seconds_of(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}

}  // namespace

// Of an arrival behind the line; negative: ahead of it.
double CameraClock::delay_of(const Point& point) const {
  const double camera_s = seconds_of(point.camera_ns - origin_.camera_ns);
  return seconds_of(point.host_ns - origin_.host_ns) - camera_s - rate_minus_1_ * camera_s - offset_s_;
}

double CameraClock::tolerance_s() const {
  return std::max(kLeastTolerance_s, 5 * (scatter_s_ + typical_delay_s_ + first_sigma_s_));
}

bool CameraClock::is_wrong(const Point& point) const {
  if (bins_.empty()) return false;
  return point.camera_ns <= *last_camera_ns_ || delay_of(point) < -tolerance_s();
}

// Of a point that is not wrong.
bool CameraClock::was_set_back(const Point& point) {
  if (bins_.empty() || delay_of(point) <= tolerance_s()) {
    late_.clear();
    return false;
  }
  late_.push_back(point);
  if (late_.size() > kLateInRow && seconds_of(point.host_ns - late_[1].host_ns) >= kLate_s) late_.pop_front();
  if (late_.size() < kLateInRow || seconds_of(point.host_ns - late_.front().host_ns) < kLate_s) return false;
  // The earliest arrivals of both halves are as late.
  const auto least_s = [this](auto from, auto to) {
    return delay_of(
        *std::min_element(from, to, [this](const Point& a, const Point& b) { return delay_of(a) < delay_of(b); }));
  };
  const auto middle = late_.begin() + static_cast<std::ptrdiff_t>(late_.size() / 2);
  return std::abs(least_s(late_.begin(), middle) - least_s(middle, late_.end())) < tolerance_s();
}

void CameraClock::start_again(std::deque<Point>& points) {
  ++restarts_;
  bins_.clear();
  for (const Point& point : points) insert(point);
  points.clear();
}

MappedStamp CameraClock::add(std::int64_t camera_ns, Stamp noticed) {
  const Point point{camera_ns, noticed.ns};
  if (is_wrong(point)) {
    const MappedStamp mapped = without_clock(point);
    if (!agrees(point)) refused_.clear();
    refused_.push_back(point);
    if (refused_.size() < kRestarts) return mapped;
    late_.clear();
    start_again(refused_);
  } else {
    refused_.clear();
    was_set_back(point) ? start_again(late_) : insert(point);
  }
  const double host_s = seconds_of(point.host_ns - origin_.host_ns) - delay_of(point);
  return {Stamp{origin_.host_ns + static_cast<std::int64_t>(std::llround(host_s * 1e9))}, sigma_s_, true};
}

// An image arrives as late as the others.
MappedStamp CameraClock::without_clock(const Point& point) const {
  return {Stamp{point.host_ns - static_cast<std::int64_t>(std::llround(typical_delay_s_ * 1e9))},
          std::max(sigma_s_, typical_delay_s_), false};
}

// Whether as much time has passed for the camera as for the host since the wrong stamp before.
bool CameraClock::agrees(const Point& point) const {
  if (refused_.empty()) return true;
  const double camera_s = seconds_of(point.camera_ns - refused_.back().camera_ns);
  const double host_s = seconds_of(point.host_ns - refused_.back().host_ns);
  const double tolerance_s = std::max(0.02, 5 * (scatter_s_ + typical_delay_s_));
  return camera_s > 0 && std::abs(camera_s - host_s) < tolerance_s;
}

void CameraClock::restart(const Point& point) {
  bins_.clear();
  origin_ = point;
  offset_s_ = rate_minus_1_ = 0;
}

void CameraClock::insert(const Point& point) {
  if (bins_.empty()) restart(point);
  last_camera_ns_ = point.camera_ns;
  const double camera_s = seconds_of(point.camera_ns - origin_.camera_ns);
  const auto number = static_cast<std::int64_t>(std::floor(camera_s / kBin_s));
  const bool begins = bins_.empty() || bins_.back().number != number;
  if (begins) bins_.push_back({number, point, {}});
  Bin& bin = bins_.back();
  if (delay_of(point) < delay_of(bin.earliest)) bin.earliest = point;
  bin.delays_s.push_back(seconds_of(point.host_ns - origin_.host_ns) - camera_s);
  while (static_cast<double>(number - bins_.front().number) * kBin_s > kWindow_s) bins_.pop_front();
  if (begins) fit_rate();
  fit_offset();
}

void CameraClock::fit_offset() {
  std::vector<double> offsets_s, delays_s;
  offset_s_ = 0;
  for (const Bin& bin : bins_) offsets_s.push_back(delay_of(bin.earliest));
  // Few bins: that of the earliest arrival of all, which a delay cannot spoil.
  offset_s_ = bins_.size() < 4 ? *std::min_element(offsets_s.begin(), offsets_s.end()) : middle_of(offsets_s);
  for (const Bin& bin : bins_) {
    const double rate_part_s = rate_minus_1_ * seconds_of(bin.earliest.camera_ns - origin_.camera_ns);
    for (const double delay_s : bin.delays_s) delays_s.push_back(delay_s - rate_part_s - offset_s_);
  }
  const auto arrivals = static_cast<double>(delays_s.size());
  typical_delay_s_ = std::max(0.0, middle_of(std::move(delays_s)));
  for (double& offset_s : offsets_s) offset_s = std::abs(offset_s - offset_s_);
  const auto count = static_cast<double>(offsets_s.size());
  scatter_s_ = kSigmaOfMad * middle_of(std::move(offsets_s));
  // How much later than the fit an ordinary arrival is bounds what is not known of the smallest delay.
  first_sigma_s_ = kFirstSigma_s / arrivals;
  sigma_s_ = std::hypot(kAtTheEnd * scatter_s_ / std::sqrt(count), typical_delay_s_, first_sigma_s_);
}

void CameraClock::fit_rate() {
  const auto span_ns = bins_.back().earliest.camera_ns - bins_.front().earliest.camera_ns;
  if (seconds_of(span_ns) < kLeastSpan_s) {
    rate_minus_1_ = 0;
    return;
  }
  std::vector<double> slopes;
  slopes.reserve(bins_.size() * (bins_.size() - 1) / 2);
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    for (std::size_t k = i + 1; k < bins_.size(); ++k) {
      const double camera_s = seconds_of(bins_[k].earliest.camera_ns - bins_[i].earliest.camera_ns);
      if (camera_s <= 0) continue;
      const double host_s = seconds_of(bins_[k].earliest.host_ns - bins_[i].earliest.host_ns);
      slopes.push_back((host_s - camera_s) / camera_s);
    }
  }
  rate_minus_1_ = std::clamp(middle_of(std::move(slopes)), -kLargestRate, kLargestRate);
}

}  // namespace spartan::internal
