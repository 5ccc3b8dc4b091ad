#include <algorithm>
#include <cmath>

#include "spartan/rig_design/rig_designer.h"

namespace spartan {
namespace {

constexpr double kTolerance_deg = 1e-9;

// The same azimuths within −180 … 180: a sector across ±180 becomes two.
std::vector<AzimuthSector> split_at_180(const std::vector<AzimuthSector>& sectors) {
  std::vector<AzimuthSector> split;
  split.reserve(2 * sectors.size());
  for (const AzimuthSector& sector : sectors) {
    if (!(sector.width_deg() > 0)) continue;
    if (sector.width_deg() >= 360) return {{-180, 180}};
    const double offset = 360 * std::floor((sector.from_deg + 180) / 360);
    const double from = sector.from_deg - offset, to = sector.to_deg - offset;
    split.push_back({from, std::min(to, 180.0)});
    if (to > 180) split.push_back({-180, to - 360});
  }
  return split;
}

}  // namespace

AzimuthSet::AzimuthSet(const std::vector<AzimuthSector>& sectors) {
  std::vector<AzimuthSector> split = split_at_180(sectors);
  std::sort(split.begin(), split.end(),
            [](const AzimuthSector& a, const AzimuthSector& b) { return a.from_deg < b.from_deg; });
  for (const AzimuthSector& next : split) {
    if (!sectors_.empty() && next.from_deg <= sectors_.back().to_deg + kTolerance_deg) {
      sectors_.back().to_deg = std::max(sectors_.back().to_deg, next.to_deg);
    } else {
      sectors_.push_back(next);
    }
  }
  std::erase_if(sectors_, [](const AzimuthSector& sector) { return sector.width_deg() < kTolerance_deg; });
}

AzimuthSet AzimuthSet::all() {
  return AzimuthSet({{-180, 180}});
}

AzimuthSet AzimuthSet::around(double middle_deg, double half_deg) {
  return half_deg >= 180 ? all() : AzimuthSet({{middle_deg - half_deg, middle_deg + half_deg}});
}

double AzimuthSet::width_deg() const {
  double width = 0;
  for (const AzimuthSector& sector : sectors_) width += sector.width_deg();
  return width;
}

bool AzimuthSet::contains(double azimuth_deg) const {
  const double azimuth = std::remainder(azimuth_deg, 360);
  return std::any_of(sectors_.begin(), sectors_.end(), [&](const AzimuthSector& sector) {
    return azimuth >= sector.from_deg && azimuth <= sector.to_deg;
  });
}

bool AzimuthSet::covers(const AzimuthSet& other) const {
  return intersected_with(other).width_deg() >= other.width_deg() - kTolerance_deg;
}

AzimuthSet AzimuthSet::rotated_by(const std::vector<double>& angles_deg) const {
  std::vector<AzimuthSector> rotated;
  rotated.reserve(sectors_.size() * angles_deg.size());
  for (const double angle : angles_deg) {
    for (const AzimuthSector& sector : sectors_) rotated.push_back({sector.from_deg + angle, sector.to_deg + angle});
  }
  return AzimuthSet(rotated);
}

AzimuthSet AzimuthSet::intersected_with(const AzimuthSet& other) const {
  std::vector<AzimuthSector> shared;
  shared.reserve(sectors_.size() + other.sectors_.size());
  for (auto a = sectors_.begin(), b = other.sectors_.begin(); a != sectors_.end() && b != other.sectors_.end();) {
    shared.push_back({std::max(a->from_deg, b->from_deg), std::min(a->to_deg, b->to_deg)});
    if (a->to_deg < b->to_deg) {
      ++a;
    } else {
      ++b;
    }
  }
  return AzimuthSet(shared);
}

}  // namespace spartan
