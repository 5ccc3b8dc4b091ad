// Accuracy of a run on a simulated recording: trajectories, disparities, maps, and how honest their uncertainties are.
//
//   mars_accuracy RUN RECORDING
//
// RUN: folder of `spartan run RECORDING`. Prints one JSON object. Maps are those of the stops at the true poses, so
// that they are evaluated alone. `make bench-mars_accuracy` needs ARGS; scripts/accuracy makes tables of many runs.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mars_scores.h"
#include "mars_stops.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"
#include "standard_recordings.h"

namespace spartan {
namespace {

using nlohmann::json;

constexpr double kFar_m = 4;        // maps are evaluated up to this range
constexpr float kFlat_m = 0.05F;    // elevations and their variances in cells of less true relief
constexpr float kOutlier_m = 0.5F;  // a cell is wrong by more than this

double median_of(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

json number(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}

// Squared errors over their variances of each of the first `axes` coordinates of a pose error.
void add_normalized(const Vector6d& error, const Matrix6d& covariance, int axes, std::vector<double>& normalized) {
  for (int i = 0; i < axes; ++i) {
    if (covariance(i, i) > 0) normalized.push_back(error[i] * error[i] / covariance(i, i));
  }
}

std::optional<Pose> truth_at(const Drive& drive, Stamp stamp) {
  for (const StampedPose& pose : drive.poses) {
    if (std::abs(pose.stamp.ns - stamp.ns) < 1'000'000) return pose.pose;
  }
  return std::nullopt;
}

json score_trajectory(const Drive& drive, const std::vector<FrameRecord>& frames, TrajectoryKind kind) {
  const Trajectory estimate = trajectory_of(frames, kind);
  TrajectoryMetricsOptions options;
  options.alignment = Alignment::yaw;
  const auto metrics = compare_trajectories(estimate, drive.poses, options);
  if (!metrics) return {{"error", metrics.error().message()}};
  std::vector<double> normalized;
  std::optional<Pose> first_truth, first;
  for (const FrameRecord& frame : frames) {
    const auto pose = pose_of(frame, kind);
    const auto truth = truth_at(drive, frame.stamp);
    if (!pose || !truth) continue;
    if (!first) {
      first = pose->pose;
      first_truth = truth;
    }
    const Pose error = (first_truth->inverse() * *truth).inverse() * (first->inverse() * pose->pose);
    add_normalized(log_se3(error), pose->covariance, 3, normalized);
  }
  return {{"ate_mm", 1e3 * metrics->ate_m.rmse},
          {"drift_percent", metrics->drift_percent ? number(*metrics->drift_percent) : json(nullptr)},
          {"normalized", number(median_of(normalized))}};
}

// Errors of single motions over their standard deviations.
double normalized_motions(const Drive& drive, const std::vector<FrameRecord>& frames) {
  std::vector<double> normalized;
  for (const FrameRecord& frame : frames) {
    if (!frame.has_pose || frame.motion.first || frame.motion.covariance.isZero()) continue;
    const auto from = truth_at(drive, frame.motion.from), to = truth_at(drive, frame.motion.to);
    if (!from || !to) continue;
    // Motions are those of the left camera.
    const Pose body_from_left = drive.rig.body_from_camera(drive.rig.find_pair(frame.pair)->left);
    const Pose truth = body_from_left.inverse() * from->inverse() * *to * body_from_left;
    const Pose error = truth.inverse() * frame.motion.previous_from_current;
    add_normalized(log_se3(error), frame.motion.covariance, 6, normalized);
  }
  return median_of(normalized);
}

struct StereoSums {
  double truth = 0, matched = 0, beyond_1_px = 0, inside = 0, squares = 0, sum = 0;
  void add(ImageView<const float> estimate, ImageView<const float> truth_px, ImageView<const std::uint8_t> mask) {
    for (int y = 0; y < truth_px.height(); ++y) {
      for (int x = 0; x < truth_px.width(); ++x) {
        if (mask(x, y) != kMaskSeenByBoth) continue;
        truth += 1;
        const double d = static_cast<double>(estimate(x, y));
        if (!(d > 0)) continue;
        matched += 1;
        const double error = d - static_cast<double>(truth_px(x, y));
        if (std::abs(error) > 1) {
          beyond_1_px += 1;
          continue;
        }
        inside += 1;
        squares += error * error;
        sum += error;
      }
    }
  }
};

// The range of true elevations in a cell of a map and `around` of its neighbours.
struct TrueCell {
  float low = std::numeric_limits<float>::infinity(), high = -std::numeric_limits<float>::infinity();
  double sum = 0;
  int count = 0;
};
TrueCell true_cell(const TerrainTruth& truth, const GeoTransform& place, int column, int row, int around) {
  const Eigen::Vector2d centre = cell_centre(place, column, row);
  const double half = (0.5 + around) * place.cell_m - 1e-6;
  const GridCell a = cell_at(truth.place, centre.x() - half, centre.y() + half),
                 b = cell_at(truth.place, centre.x() + half, centre.y() - half);
  TrueCell cell;
  for (int y = a.row; y <= b.row; ++y) {
    for (int x = a.column; x <= b.column; ++x) {
      if (!truth.surface_m.contains(x, y)) return {};
      const float z = truth.surface_m(x, y);
      cell.low = std::min(cell.low, z);
      cell.high = std::max(cell.high, z);
      cell.sum += static_cast<double>(z);
      ++cell.count;
    }
  }
  return cell;
}

struct MapSums {
  Sums scores;
  double cells = 0, outliers = 0, largest_m = 0;
  std::vector<double> normalized;

  void add_cells(const LocalMap& map, const TerrainTruth& truth, const Eigen::Vector2d& viewpoint) {
    for (int y = 0; y < map.size().height; ++y) {
      for (int x = 0; x < map.size().width; ++x) {
        const float z = map.elevation_m(x, y);
        if (!std::isfinite(z) || (cell_centre(map.place, x, y) - viewpoint).norm() > kFar_m) continue;
        const TrueCell near = true_cell(truth, map.place, x, y, 1);
        if (near.count == 0) continue;
        ++cells;
        const float off = std::max({near.low - z, z - near.high, 0.0F});
        outliers += off > kOutlier_m ? 1 : 0;
        largest_m = std::max(largest_m, static_cast<double>(off));
        const TrueCell here = true_cell(truth, map.place, x, y, 0);
        if (here.count == 0 || here.high - here.low > kFlat_m) continue;
        const double error = static_cast<double>(z) - here.sum / here.count;
        normalized.push_back(error * error / static_cast<double>(map.variance_m2(x, y)));
      }
    }
  }
};

// Roughness of the ground without rocks: the median over squares of 1 m of the RMS distance from a plane.
double roughness_of(const TerrainTruth& truth) {
  const int side = static_cast<int>(std::lround(1 / truth.place.cell_m));
  std::vector<double> values;
  for (int y0 = 0; y0 + side <= truth.ground_m.height(); y0 += side) {
    for (int x0 = 0; x0 + side <= truth.ground_m.width(); x0 += side) {
      Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
      Eigen::Vector3d right = Eigen::Vector3d::Zero();
      double squares = 0;
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
          const Eigen::Vector3d row(1, x - 0.5 * side, y - 0.5 * side);
          const double z = static_cast<double>(truth.ground_m(x0 + x, y0 + y) - truth.ground_m(x0, y0));
          normal += row * row.transpose();
          right += z * row;
          squares += z * z;
        }
      }
      const double residual = squares - right.dot(normal.ldlt().solve(right));
      values.push_back(std::sqrt(std::max(residual, 0.0) / (side * side)));
    }
  }
  return median_of(values);
}

// True disparities refer to the rectification by the recording's own rig, so these disparities are those of the
// calibration as it is, whatever rig the run aligned.
json score_disparities(Drive& drive, Imager& imager) {
  StopMapper mapper = StopMapper::create({}, {}, ThreadPool(2)).value();
  StereoSums stereo;
  for (const auto& [position, frames] : drive.stops) {
    add_views(drive, imager, mapper, frames);
    for (const StopView& view : mapper.views()) {
      const std::string name = fmt::format("/{}/{}.png", view.pair, view.stamp.ns);
      const auto disparity = read_disparity(drive.folder + "/truth/disparity" + name);
      const auto mask = read_truth_mask(drive.folder + "/truth/mask" + name);
      if (disparity && mask) stereo.add(view.disparity, *disparity, *mask);
    }
  }
  return {{"rms_px", number(std::sqrt(stereo.squares / stereo.inside))},
          {"bias_px", number(stereo.sum / stereo.inside)},
          {"beyond_1_px_percent", number(100 * stereo.beyond_1_px / stereo.matched)},
          {"unmatched_percent", number(100 * (1 - stereo.matched / stereo.truth))}};
}

void score_stops(Drive& drive, json& result) {
  auto imager = Imager::create(drive.rig, ImagingOptions(), ThreadPool(2));
  if (!imager || drive.stops.empty()) return;
  StopMapper mapper = StopMapper::create({}, {}, ThreadPool(2)).value();
  const DriveTruth of_drive(drive);
  const TerrainTruth truth = of_drive.view();
  MapSums maps;
  for (const auto& [position, frames] : drive.stops) {
    add_views(drive, *imager, mapper, frames);
    const Pose pose = true_pose(drive, frames.front().left_stamp);
    const LocalMap map = mapper.map(surface_points(mapper.merge()), pose);
    Visibility visibility(map.size());
    for (const StopView& view : mapper.views()) {
      add_true_view(drive, view.pair, view.stamp, view.geometry, pose, map.place, visibility);
    }
    MapMetricsOptions scoring;
    scoring.viewpoint_m = pose.translation().head<2>();
    scoring.farthest_m = kFar_m;
    maps.scores.add(evaluate_map(
        {map.place, map.elevation_m, class_band(map.kind), visibility.pixels, visibility.lowest_m}, truth, scoring));
    maps.add_cells(map, truth, scoring.viewpoint_m);
  }
  const Sums& s = maps.scores;
  result["maps"] = {{"bias_mm", number(1e3 * s.error / s.cells)},
                    {"rms_mm", number(1e3 * std::sqrt(s.squares / s.cells))},
                    {"coverage_percent", number(100 * s.covered / s.visible)},
                    {"obstacles", s.obstacles},
                    {"obstacles_found", s.found},
                    {"false_percent", number(100 * s.false_marks / s.free)},
                    {"cells", maps.cells},
                    {"outliers", maps.outliers},
                    {"largest_outlier_m", maps.largest_m},
                    {"normalized", number(median_of(maps.normalized))},
                    {"roughness_mm", number(1e3 * roughness_of(truth))}};
}

void score(const std::string& run_folder, const std::string& recording) {
  auto drive = open_drive(recording);
  if (!drive) throw std::runtime_error(drive.error().message());
  auto store = RunStore::open_read_only(RunFolder{run_folder}.store());
  if (!store) throw std::runtime_error(store.error().message());
  const auto frames = store->frames();
  if (!frames) throw std::runtime_error(frames.error().message());
  const auto rig = read_rig_yaml(RunFolder{run_folder}.rig());
  if (!rig) throw std::runtime_error(rig.error().message());
  json result;
  auto own_imager = Imager::create(drive->rig, ImagingOptions(), ThreadPool(2));
  if (own_imager) result["stereo"] = score_disparities(*drive, *own_imager);
  drive->rig = *rig;
  for (const TrajectoryKind kind : kTrajectoriesBestFirst) {
    if (has_trajectory(*frames, kind)) result[std::string(name_of(kind))] = score_trajectory(*drive, *frames, kind);
  }
  result["odometry"]["normalized_motions"] = number(normalized_motions(*drive, *frames));
  score_stops(*drive, result);
  fmt::print("{}\n", result.dump());
}

void run(const std::vector<std::string>& words) {
  if (words.size() != 2) throw std::invalid_argument("usage: mars_accuracy RUN RECORDING");
  score(words[0], words[1]);
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
