#include "spartan/slam/map_merger.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace spartan {
namespace {

constexpr std::uint32_t kMergerVersion = 1;
/// Directions without information have an eigenvalue of 0, determined ones of about 1 and more.
constexpr double kDetermined = 1e-6;

Matrix6d symmetric(const Matrix6d& m) {
  return 0.5 * (m + m.transpose());
}

struct Correction {
  UncertainPose corrected;
  Matrix6d relative;  // covariance of the corrected pose relative to the map
};

// Updates the prior pose (covariance P) by a match of information I with a map of covariance M whose errors are
// correlated with those of the pose: cross-covariance C. The difference of both has the covariance Q = P + M − 2 C, and
// the optimal gain is K = (P − C)(Q + I⁻¹)⁻¹.
Correction updated_by_match(const UncertainPose& prior, const Pose& match, const Matrix6d& match_information,
                            const Matrix6d& map_covariance) {
  const Vector6d offset = log_se3(prior.pose.inverse() * match);
  const Matrix6d jacobian = right_jacobian_se3(offset);
  // Perturbations of the match as perturbations of the prior pose: log(prior⁻¹ match Exp δ) = offset + J_r⁻¹ δ.
  const Matrix6d information = jacobian.transpose() * match_information * jacobian;
  const Matrix6d independent =
      symmetric(prior.covariance * (Matrix6d::Identity() - shared_fraction(prior.covariance, map_covariance)));
  const Matrix6d difference = independent + map_covariance - (prior.covariance - independent);
  const Matrix6d gain = independent * inflated(information, difference);
  const Vector6d step = gain * offset;
  const Matrix6d jacobian_of_step = right_jacobian_se3(step);
  const Matrix6d reduction = gain * independent.transpose(), cross = gain * difference;
  return {{prior.pose * exp_se3(step),
           symmetric(jacobian_of_step * (prior.covariance - reduction) * jacobian_of_step.transpose())},
          symmetric(difference - cross - cross.transpose() + reduction)};
}

// The translation in metres of a tangent without the directions that the match determines. Directions are compared in
// units of the largest standard deviations that count as determined.
double undetermined_shift(const Matrix6d& information, const Vector6d& tangent, const MatchOptions& options) {
  Vector6d unit;
  unit << Eigen::Vector3d::Constant(options.max_sigma_m),
      Eigen::Vector3d::Constant(options.max_sigma_deg * std::numbers::pi / 180);
  const SymmetricEigen axes = eigen_of_symmetric(unit.asDiagonal() * information * unit.asDiagonal());
  Vector6d rest = tangent.cwiseQuotient(unit);
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (axes.values[k] > kDetermined) rest -= axes.vectors.col(k).dot(rest) * axes.vectors.col(k);
  }
  return rest.cwiseProduct(unit).head<3>().norm();
}

// Covariance of the map under the local map: the mean of the covariances of the stops that observed it, weighted by
// cells, each transported rigidly to this body frame.
Matrix6d map_covariance(const MapExcerpt& global, const LocalMap& local, const Pose& world_from_body) {
  const MapView& view = global.view;
  std::map<std::int32_t, int> cells;
  const LatticeWindow local_window = window_of(local.place, local.size());
  int all = 0;
  for (int r = 0; r < local_window.height; ++r) {
    for (int c = 0; c < local_window.width; ++c) {
      const int column = c + local_window.west - view.window.west, row = r + view.window.north - local_window.north;
      if (!(local.count(c, r) > 0) || !view.stop.contains(column, row) || view.stop(column, row) < 0) continue;
      ++cells[view.stop(column, row)];
      ++all;
    }
  }
  Matrix6d mean = Matrix6d::Zero();
  for (const auto& [id, count] : cells) {
    const auto stop =
        std::find_if(global.stops.begin(), global.stops.end(), [&](const MapStop& s) { return s.id == id; });
    if (stop == global.stops.end()) continue;
    const Matrix6d transport = adjoint(world_from_body.inverse() * stop->world_from_body.pose);
    mean += (static_cast<double>(count) / all) * transport * stop->world_from_body.covariance * transport.transpose();
  }
  return symmetric(mean);
}

// Half side of the part of the global map that a local map can overlap anywhere in the search window.
double view_reach(const MapOptions& map, const MatchOptions& match) {
  const double half = 0.5 * map.extent_m;
  return half + match.max_search_m + 1.5 * half * std::sin(match.max_search_deg * std::numbers::pi / 180);
}

}  // namespace

Result<MapMerger> MapMerger::create(const SlamOptions& options, const MapOptions& map_options,
                                    const ThreadPool& workers) {
  if (Status valid = validate(options, "SLAM options"); !valid) return failure(valid);
  if (Status valid = validate(map_options, "map options"); !valid) return failure(valid);
  auto map = GlobalMap::create(options.map, map_options.cell_m);
  if (!map) return failure(map);
  return MapMerger(options, map_options, std::move(*map), workers);
}

MapMerger::MapMerger(const SlamOptions& options, const MapOptions& map_options, GlobalMap map,
                     const ThreadPool& workers)
    : options_(options), map_options_(map_options), workers_(workers), map_(std::move(map)) {}

Result<MapMergeResult> MapMerger::add(std::span<const SurfacePoint> points, const Stamp& stamp,
                                      const UncertainPose& world_from_body) {
  const auto global = excerpt_around(world_from_body.pose);
  if (!global) return failure(global);
  MapMergeResult result = match(points, stamp, world_from_body, *global, workers_);
  if (Status s = fuse(result); !s) return failure(s);
  return result;
}

Result<std::optional<MapExcerpt>> MapMerger::excerpt_around(const Pose& world_from_body) {
  if (map_.empty()) return std::nullopt;
  const Eigen::Vector3d& at = world_from_body.translation();
  auto view = map_.view(window_around(at.x(), at.y(), view_reach(map_options_, options_.match), map_options_.cell_m));
  if (!view) return failure(view);
  return MapExcerpt{std::move(*view), map_.stops()};
}

MapMergeResult MapMerger::match(std::span<const SurfacePoint> points, const Stamp& stamp,
                                const UncertainPose& world_from_body, const std::optional<MapExcerpt>& global,
                                const ThreadPool& workers) const {
  const MapGenerator generator = MapGenerator::create(map_options_, workers).value();  // create() has validated them
  MapMergeResult result;
  result.stamp = stamp;
  result.corrected = world_from_body;
  result.match.world_from_body = world_from_body.pose;
  result.local = generator.generate(points, world_from_body.pose);
  if (!global) return result;
  result.match =
      match_map(points, result.local, global->view, world_from_body, map_options_.min_points, options_.match, workers);
  MapMatch& match = result.match;
  const Matrix6d of_map = map_covariance(*global, result.local, match.world_from_body);
  Correction update = updated_by_match(world_from_body, match.world_from_body, match.information, of_map);
  // A match that does not determine all directions holds near the prior only: elsewhere the ground has another height
  // and slope. So the correction by it stays within the basin of the refinement in directions that it does not
  // determine.
  const Vector6d step = log_se3(world_from_body.pose.inverse() * update.corrected.pose);
  if (match.status == MatchStatus::flat &&
      undetermined_shift(match.information, step, options_.match) > options_.match.step_m) {
    match.information.setZero();
    update = updated_by_match(world_from_body, match.world_from_body, match.information, of_map);
  }
  result.relative_covariance = update.relative;
  if (!match.information.isZero()) {
    result.constraint = PoseConstraint{stamp, match.world_from_body, match.information, of_map};
    result.corrected = update.corrected;
    result.local = generator.generate(points, result.corrected.pose);
  }
  return result;
}

Status MapMerger::fuse(const MapMergeResult& matched) {
  return map_.add(matched.local, matched.stamp, matched.corrected, matched.relative_covariance);
}

Bytes MapMerger::save() const {
  ArchiveWriter out;
  out.put(kMergerVersion);
  out.put(static_cast<std::uint64_t>(map_.submaps().size()));
  out.put(static_cast<std::uint64_t>(map_.stops().size()));
  out.put(static_cast<std::uint64_t>(map_.tiles()));
  return out.take();
}

Status MapMerger::restore(const Bytes& bytes, TileStore& store) {
  ArchiveReader in(bytes);
  const std::string what = "saved state of the map merging";
  if (Status s = in.expect_version(kMergerVersion, what); !s) return s;
  const auto submaps = in.get<std::uint64_t>(), stops = in.get<std::uint64_t>(), tiles = in.get<std::uint64_t>();
  if (Status s = in.finish(what); !s) return s;
  auto map = GlobalMap::from_store(options_.map, map_options_.cell_m, store);
  if (!map) return failure(map);
  if (map->submaps().size() != submaps || map->stops().size() != stops || map->tiles() != tiles) {
    return failure(ErrorCode::store_damaged, "does not fit the map tables of the store", what,
                   "run again into a new folder");
  }
  map_ = std::move(*map);
  return {};
}

}  // namespace spartan
