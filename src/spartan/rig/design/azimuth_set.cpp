#include "spartan/rig/design/azimuth_set.h"

#include <algorithm>
#include <cmath>

namespace spartan {
namespace {

constexpr double kNothing_deg = 1e-9;

// The same directions within −180 … 180: a sector over the back becomes two.
std::vector<AzimuthSector> cut_behind(const std::vector<AzimuthSector>& sectors) {
  std::vector<AzimuthSector> cut;
  cut.reserve(2 * sectors.size());
  for (const AzimuthSector& sector : sectors) {
    if (!(sector.width_deg() > 0)) continue;
    if (sector.width_deg() >= 360) return {{-180, 180}};
    const double turns = 360 * std::floor((sector.from_deg + 180) / 360);
    const double from = sector.from_deg - turns, to = sector.to_deg - turns;
    cut.push_back({from, std::min(to, 180.0)});
    if (to > 180) cut.push_back({-180, to - 360});
  }
  return cut;
}

}  // namespace

AzimuthSet::AzimuthSet(const std::vector<AzimuthSector>& sectors) {
  std::vector<AzimuthSector> cut = cut_behind(sectors);
  std::sort(cut.begin(), cut.end(),
            [](const AzimuthSector& a, const AzimuthSector& b) { return a.from_deg < b.from_deg; });
  for (const AzimuthSector& next : cut) {
    if (!sectors_.empty() && next.from_deg <= sectors_.back().to_deg + kNothing_deg) {
      sectors_.back().to_deg = std::max(sectors_.back().to_deg, next.to_deg);
    } else {
      sectors_.push_back(next);
    }
  }
  std::erase_if(sectors_, [](const AzimuthSector& sector) { return sector.width_deg() < kNothing_deg; });
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
  return within(other).width_deg() >= other.width_deg() - kNothing_deg;
}

AzimuthSet AzimuthSet::turned_by(const std::vector<double>& angles_deg) const {
  std::vector<AzimuthSector> turned;
  turned.reserve(sectors_.size() * angles_deg.size());
  for (const double angle : angles_deg) {
    for (const AzimuthSector& sector : sectors_) turned.push_back({sector.from_deg + angle, sector.to_deg + angle});
  }
  return AzimuthSet(turned);
}

AzimuthSet AzimuthSet::within(const AzimuthSet& other) const {
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
