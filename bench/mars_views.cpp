// Ground detection and merging of the views of simulated stops. `make bench-mars_views`.
//
//   mars_views [--from FOLDER] [--stops N] SCENARIO...
//
// Measures the error of the camera's height and pitch above the ground by v-disparity, against the plane through the
// true points in view; the coverage of the merged view against the best single view; and the height steps at seams.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mars_stops.h"
#include "spartan/core/pose.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/numerics/median.h"
#include "standard_recordings.h"

namespace spartan {
namespace {

constexpr double kFarthest_m = 4;  // range of the points of the true ground plane

// Least-squares plane through the true points.
std::optional<GroundPlane> true_plane(const Drive& drive, const StopView& view) {
  const auto disparity =
      read_disparity(fmt::format("{}/truth/disparity/{}/{}.png", drive.folder, view.pair, view.stamp.ns));
  if (!disparity) return std::nullopt;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double count = 0;
  for (int y = 0; y < disparity->height(); y += 4) {
    for (int x = 0; x < disparity->width(); x += 4) {
      if (!((*disparity)(x, y) > 0)) continue;
      const Eigen::Vector3d p = view.geometry.stereo.triangulate(x, y, (*disparity)(x, y));
      if (p.norm() > kFarthest_m) continue;
      sum += p;
      squares += p * p.transpose();
      ++count;
    }
  }
  if (count < 100) return std::nullopt;
  const Eigen::Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares / count - mean * mean.transpose());
  Eigen::Vector3d up = axes.eigenvectors().col(0);
  if (up.dot(mean) > 0) up = -up;
  return GroundPlane{up, -up.dot(mean)};
}

struct GroundErrors {
  std::vector<double> height_m, pitch_deg;
};

int known_cells(const LocalMap& map) {
  int count = 0;
  for (int y = 0; y < map.size().height; ++y) {
    for (int x = 0; x < map.size().width; ++x) count += map.count(x, y) > 0 ? 1 : 0;
  }
  return count;
}

// Number of known cells in the map of a single view of the stop.
int known_cells_of(const StopView& view, StopMapper& mapper, const Pose& pose) {
  const std::vector<ViewGeometry> geometry{view.geometry};
  const auto merger =
      DisparityMerger::create({}, Pose::from_translation({0, 0, 1}), geometry, 0.3, ThreadPool(2)).value();
  const std::vector<MergedView> views{{view.geometry, view.disparity, view.sigma, view.left, {}}};
  return known_cells(mapper.map(surface_points(merger.merge(views)), pose));
}

// Height error of a pixel of the merged view.
std::optional<double> height_error(const MergedRange& merged, const Drive& drive, const Pose& pose, int x, int y) {
  const double range = merged.range_m(x, y);
  if (!std::isfinite(range)) return std::nullopt;
  const Eigen::Vector3d p = pose * (merged.body_from_centre * Eigen::Vector3d(range * merged.camera.direction(x, y)));
  const GridCell cell = cell_at(drive.elevation.place, p.x(), p.y());
  const Image<float>& surface = drive.elevation.bands[0];
  if (!surface.contains(cell.column, cell.row)) return std::nullopt;
  return p.z() - surface(cell.column, cell.row);
}

// Median step of the height error across each seam between two sets of views. Uses pixels with errors below 5 cm, that
// is ground, where an offset of one cell does not matter.
std::vector<double> seams(const MergedRange& merged, const Drive& drive, const Pose& pose) {
  std::map<std::pair<int, int>, std::vector<double>> steps;
  for (int y = 0; y < merged.range_m.height(); ++y) {
    for (int x = 0; x + 1 < merged.range_m.width(); ++x) {
      const int a = merged.views(x, y), b = merged.views(x + 1, y);
      if (a == 0 || b == 0 || a == b) continue;
      const auto left = height_error(merged, drive, pose, x, y), right = height_error(merged, drive, pose, x + 1, y);
      if (left && right && std::abs(*left) < 0.05 && std::abs(*right) < 0.05) steps[{a, b}].push_back(*right - *left);
    }
  }
  std::vector<double> medians;
  for (auto& [border, values] : steps) {
    if (values.size() >= 50) medians.push_back(std::abs(median(std::move(values))));
  }
  return medians;
}

void evaluate(const std::string& folder, const std::string& scenario, int wanted) {
  auto drive = open_drive(folder + "/" + scenario);
  if (!drive) {
    fmt::print("{:<18} skipped: {} (create it with scripts/recordings)\n", scenario, drive.error().message());
    return;
  }
  auto imager = Imager::create(drive->rig, ImagingOptions(), ThreadPool(2));
  if (!imager) return;
  StopMapper mapper = StopMapper::create({}, {}, ThreadPool(2)).value();
  std::map<std::string, GroundErrors> ground_errors;
  std::vector<double> gains, steps;
  int stops = 0;
  for (const auto& [position, frames] : drive->stops) {
    if (stops++ == wanted) break;
    add_views(*drive, *imager, mapper, frames);
    const Pose pose = true_pose(*drive, frames.front().left_stamp);
    int best = 0;
    for (const StopView& view : mapper.views()) {
      best = std::max(best, known_cells_of(view, mapper, pose));
      const auto plane = true_plane(*drive, view);
      if (!plane || !view.ground) continue;
      GroundErrors& errors = ground_errors[view.pair];
      errors.height_m.push_back(std::abs(view.ground->plane.height_m - plane->height_m));
      errors.pitch_deg.push_back(std::abs(view.ground->plane.pitch_rad() - plane->pitch_rad()) /
                                 spartan::kRadiansPerDegree);
    }
    const MergedRange merged = mapper.merge();
    gains.push_back(static_cast<double>(known_cells(mapper.map(surface_points(merged), pose))) / best);
    for (const double step : seams(merged, *drive, pose)) steps.push_back(step);
  }
  for (const auto& [pair, errors] : ground_errors) {
    fmt::print(
        "{:<18} {:<7} camera above the ground, median and largest error: {:.1f} and {:.1f} mm, {:.2f} and {:.2f} deg\n",
        scenario, pair, 1e3 * median(errors.height_m),
        1e3 * *std::max_element(errors.height_m.begin(), errors.height_m.end()), median(errors.pitch_deg),
        *std::max_element(errors.pitch_deg.begin(), errors.pitch_deg.end()));
  }
  fmt::print("{:<18} cells of the merged view over those of the best view: minimum {:.2f}, median {:.2f}\n", scenario,
             *std::min_element(gains.begin(), gains.end()), median(gains));
  fmt::print("{:<18} height steps at {} seams: median {:.1f} mm, largest {:.1f} mm\n", scenario, steps.size(),
             1e3 * median(steps), 1e3 * *std::max_element(steps.begin(), steps.end()));
  std::fflush(stdout);
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--stops", "10"}});
  if (arguments.scenarios.empty())
    arguments.scenarios = {"rocky_20pct", "crater_rim", "flat_featureless", "diffuse_200lux"};
  for (const std::string& scenario : arguments.scenarios)
    evaluate(arguments.folder, scenario, arguments.number("--stops"));
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
