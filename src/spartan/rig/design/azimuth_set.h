// Directions over level ground: which of them are seen, where that begins and where it ends.
#pragma once

#include <vector>

namespace spartan {

/// From one direction to another, degrees, positive to the left of straight ahead; from < to.
struct AzimuthSector {
  double from_deg = 0, to_deg = 0;
  double width_deg() const { return to_deg - from_deg; }
};

/// A set of directions. Single directions and gaps of less than 10⁻⁹ degrees do not count.
class AzimuthSet {
 public:
  AzimuthSet() = default;  ///< none
  static AzimuthSet all();
  /// What lies within `half_deg` of the middle, any number of turns around; none for 0 and less, all for 180 and more.
  static AzimuthSet around(double middle_deg, double half_deg);

  /// Apart from each other, rising, within −180 … 180; what goes on behind the back is cut there.
  const std::vector<AzimuthSector>& sectors() const { return sectors_; }
  double width_deg() const;
  bool empty() const { return sectors_.empty(); }
  bool contains(double azimuth_deg) const;
  /// Nothing of the other is left out.
  bool covers(const AzimuthSet& other) const;

  /// The union of the set turned by each of these angles to the left.
  AzimuthSet turned_by(const std::vector<double>& angles_deg) const;
  /// What both have.
  AzimuthSet within(const AzimuthSet& other) const;

 private:
  explicit AzimuthSet(const std::vector<AzimuthSector>& sectors);  // in any order, overlapping or not, anywhere

  std::vector<AzimuthSector> sectors_;
};

}  // namespace spartan
