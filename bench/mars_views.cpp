// What the views of simulated stops say for themselves and together. `make bench-mars_views`.
//
//   mars_views [--from FOLDER] [--stops N] SCENARIO...
//
// The eye's height and pitch over the ground as v-disparity finds them, beside the plane through the true points that
// the pair sees; how much the merged view covers beside the best single pair; the steps where views join.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mars_stops.h"
#include "spartan/core/median.h"
#include "spartan/eval/disparity_truth.h"
#include "standard_recordings.h"

namespace spartan {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kFarthest_m = 4;  // of what counts as the ground before a pair

// The plane through the true points, by least squares.
std::optional<GroundPlane> true_plane(const Drive& drive, const PositionView& view) {
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

struct Stand {
  std::vector<double> height_m, pitch_deg;
};

int known_cells(const LocalMap& map) {
  int count = 0;
  for (int y = 0; y < map.size().height; ++y) {
    for (int x = 0; x < map.size().width; ++x) count += map.count(x, y) > 0 ? 1 : 0;
  }
  return count;
}

// The map of a single view of the stop.
int cells_of_one(const PositionView& view, PositionMapper& mapper, const Pose& pose) {
  const std::vector<ViewGeometry> geometry{view.geometry};
  const DisparityMerger merger({}, Pose::from_translation({0, 0, 1}), geometry, 0.3, Workers(2));
  const std::vector<MergedView> views{{view.geometry, view.disparity, view.left, {}}};
  return known_cells(mapper.map(surface_points(merger.merge(views)), pose));
}

// Error of the height of a pixel of the merged view.
std::optional<double> height_error(const MergedRange& merged, const Drive& drive, const Pose& pose, int x, int y) {
  const double range = merged.range_m(x, y);
  if (!std::isfinite(range)) return std::nullopt;
  const Eigen::Vector3d p = pose * (merged.body_from_centre * Eigen::Vector3d(range * merged.camera.direction(x, y)));
  const GridCell cell = cell_at(drive.elevation.place, p.x(), p.y());
  const Image<float>& surface = drive.elevation.bands[0];
  if (!surface.contains(cell.column, cell.row)) return std::nullopt;
  return p.z() - surface(cell.column, cell.row);
}

// Across each border between two sets of views: the median step of the height's error. On ground, where a pixel beside
// the true surface's cell does not matter.
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

void judge(const std::string& folder, const std::string& scenario, int wanted) {
  auto drive = open_drive(folder + "/" + scenario);
  if (!drive) {
    fmt::print("{:<18} left out: {} (scripts/recordings makes it)\n", scenario, drive.error().message());
    return;
  }
  auto imager = Imager::create(drive->rig, ImagingOptions(), Workers(2));
  if (!imager) return;
  PositionMapper mapper({}, {}, Workers(2));
  std::map<std::string, Stand> stands;
  std::vector<double> gains, steps;
  int stops = 0;
  for (const auto& [position, shots] : drive->stops) {
    if (stops++ == wanted) break;
    look(*drive, *imager, mapper, shots);
    const Pose pose = true_pose(*drive, shots.front().left_stamp);
    int best = 0;
    for (const PositionView& view : mapper.views()) {
      best = std::max(best, cells_of_one(view, mapper, pose));
      const auto plane = true_plane(*drive, view);
      if (!plane || !view.ground) continue;
      Stand& stand = stands[view.pair];
      stand.height_m.push_back(std::abs(view.ground->plane.height_m - plane->height_m));
      stand.pitch_deg.push_back(std::abs(view.ground->plane.pitch_rad() - plane->pitch_rad()) / kDegree);
    }
    const MergedRange merged = mapper.merge();
    gains.push_back(static_cast<double>(known_cells(mapper.map(surface_points(merged), pose))) / best);
    for (const double step : seams(merged, *drive, pose)) steps.push_back(step);
  }
  for (const auto& [pair, stand] : stands) {
    fmt::print(
        "{:<18} {:<7} eye over the ground, median and largest error: {:.1f} and {:.1f} mm, {:.2f} and {:.2f} deg\n",
        scenario, pair, 1e3 * median(stand.height_m),
        1e3 * *std::max_element(stand.height_m.begin(), stand.height_m.end()), median(stand.pitch_deg),
        *std::max_element(stand.pitch_deg.begin(), stand.pitch_deg.end()));
  }
  fmt::print("{:<18} cells of the merged view over those of the best pair: {:.2f} at least, {:.2f} in the middle\n",
             scenario, *std::min_element(gains.begin(), gains.end()), median(gains));
  fmt::print("{:<18} steps at {} borders between views: median {:.1f} mm, largest {:.1f} mm\n", scenario, steps.size(),
             1e3 * median(steps), 1e3 * *std::max_element(steps.begin(), steps.end()));
  std::fflush(stdout);
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--stops", "10"}});
  if (arguments.scenarios.empty())
    arguments.scenarios = {"rocky_20pct", "crater_rim", "flat_featureless", "diffuse_200lux"};
  for (const std::string& scenario : arguments.scenarios)
    judge(arguments.folder, scenario, arguments.number("--stops"));
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
