// Sets of azimuths over level ground, as intervals on a circle.
#pragma once

#include <vector>

namespace spartan {

/// An interval of azimuths, degrees, positive to the left of straight ahead; from < to.
struct AzimuthSector {
  double from_deg = 0, to_deg = 0;
  double width_deg() const { return to_deg - from_deg; }
};

/// A set of azimuths. Intervals and gaps of less than 10⁻⁹ degrees are ignored.
class AzimuthSet {
 public:
  AzimuthSet() = default;  ///< empty
  static AzimuthSet all();
  /// Azimuths within `half_deg` of the middle, modulo 360°; empty for 0 and less, all for 180 and more.
  static AzimuthSet around(double middle_deg, double half_deg);

  /// Disjoint, ascending, within −180 … 180; an interval across ±180 is split there.
  const std::vector<AzimuthSector>& sectors() const { return sectors_; }
  double width_deg() const;
  bool empty() const { return sectors_.empty(); }
  bool contains(double azimuth_deg) const;
  /// Whether the other set is a subset of this one.
  bool covers(const AzimuthSet& other) const;

  /// The union of this set rotated by each of the angles (positive to the left).
  AzimuthSet rotated_by(const std::vector<double>& angles_deg) const;
  /// The intersection of both sets.
  AzimuthSet intersected_with(const AzimuthSet& other) const;

 private:
  explicit AzimuthSet(const std::vector<AzimuthSector>& sectors);  // in any order, possibly overlapping, any range

  std::vector<AzimuthSector> sectors_;
};

}  // namespace spartan
