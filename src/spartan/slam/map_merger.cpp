#include "spartan/slam/map_merger.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace spartan {
namespace {

constexpr std::uint32_t kVersion = 1;

Matrix6d symmetric(const Matrix6d& m) {
  return 0.5 * (m + m.transpose());
}

struct Correction {
  UncertainPose corrected;
  Matrix6d relative;  // covariance of the corrected pose against the map
};

// The given pose P moved towards the match: best where the errors of pose and map (covariance M) have the part C in
// common. Their difference has Q = P + M − 2 C, and the gain is K = (P − C)(Q + I⁻¹)⁻¹ for a match of information I.
Correction moved_towards(const UncertainPose& given, const Pose& match, const Matrix6d& match_information,
                         const Matrix6d& map_covariance) {
  const Vector6d offset = log_se3(given.pose.inverse() * match);
  const Matrix6d from_match = right_jacobian_se3(offset);
  // Perturbations of the match as perturbations of the given pose: log(P⁻¹ M Exp δ) = offset + J_r⁻¹ δ.
  const Matrix6d information = from_match.transpose() * match_information * from_match;
  const Matrix6d own =
      symmetric(given.covariance * (Matrix6d::Identity() - common_share(given.covariance, map_covariance)));
  const Matrix6d apart = own + map_covariance - (given.covariance - own);
  const Matrix6d gain = own * blurred(information, apart);
  const Vector6d step = gain * offset;
  const Matrix6d turn = right_jacobian_se3(step);
  const Matrix6d learnt = gain * own.transpose(), unlearnt = gain * apart;
  return {{given.pose * exp_se3(step), symmetric(turn * (given.covariance - learnt) * turn.transpose())},
          symmetric(apart - unlearnt - unlearnt.transpose() + learnt)};
}

double view_reach(const MapOptions& map, const MatchOptions& match) {
  const double half = 0.5 * map.extent_m;
  return half + match.widest_m + 1.5 * half * std::sin(match.widest_deg * std::numbers::pi / 180);
}

}  // namespace

MapMerger::MapMerger(const SlamOptions& options, const MapOptions& map_options, const Workers& workers)
    : options_(options),
      map_options_(map_options),
      workers_(workers),
      generator_(map_options, workers),
      map_(options.map, map_options.cell_m) {}

// Mean covariance of the stops that mapped the ground under the local map, each carried over to this body rigidly.
Matrix6d MapMerger::map_covariance(const MapView& view, const LocalMap& local, const Pose& world_from_body) const {
  std::map<std::int32_t, int> cells;
  const LatticeWindow ours = window_of(local.place, local.size());
  int all = 0;
  for (int r = 0; r < ours.height; ++r) {
    for (int c = 0; c < ours.width; ++c) {
      const int column = c + ours.west - view.window.west, row = r + view.window.north - ours.north;
      if (!(local.count(c, r) > 0) || !view.stop.contains(column, row) || view.stop(column, row) < 0) continue;
      ++cells[view.stop(column, row)];
      ++all;
    }
  }
  Matrix6d mean = Matrix6d::Zero();
  for (const auto& [id, count] : cells) {
    const auto stop =
        std::find_if(map_.stops().begin(), map_.stops().end(), [&](const MapStop& s) { return s.id == id; });
    if (stop == map_.stops().end()) continue;
    const Matrix6d carry = adjoint(world_from_body.inverse() * stop->world_from_body.pose);
    mean += (static_cast<double>(count) / all) * carry * stop->world_from_body.covariance * carry.transpose();
  }
  return symmetric(mean);
}

Result<MapMergeResult> MapMerger::add(std::span<const SurfacePoint> points, const Stamp& stamp,
                                      const UncertainPose& world_from_body) {
  MapMergeResult result;
  result.corrected = world_from_body;
  result.match.world_from_body = world_from_body.pose;
  Matrix6d relative = Matrix6d::Zero();
  result.local = generator_.generate(points, world_from_body.pose);
  if (!map_.empty()) {
    const Eigen::Vector3d& at = world_from_body.pose.translation();
    const auto view =
        map_.view(window_around(at.x(), at.y(), view_reach(map_options_, options_.match), map_options_.cell_m));
    if (!view) return failure(view);
    result.match =
        match_map(points, result.local, *view, world_from_body, map_options_.fewest_points, options_.match, workers_);
    const MapMatch& match = result.match;
    const Matrix6d of_map = map_covariance(*view, result.local, match.world_from_body);
    Correction moved = moved_towards(world_from_body, match.world_from_body, match.information, of_map);
    relative = moved.relative;
    if (!match.information.isZero()) {
      result.constraint = PoseConstraint{stamp, match.world_from_body, match.information, of_map};
      result.corrected = moved.corrected;
      result.local = generator_.generate(points, result.corrected.pose);
    }
  }
  if (Status s = map_.add(result.local, stamp, result.corrected, relative); !s) return failure(s);
  return result;
}

Bytes MapMerger::save() const {
  ArchiveWriter out;
  out.put(kVersion);
  out.put(static_cast<std::uint64_t>(map_.submaps().size()));
  out.put(static_cast<std::uint64_t>(map_.stops().size()));
  out.put(static_cast<std::uint64_t>(map_.tiles()));
  return out.take();
}

Status MapMerger::restore(const Bytes& bytes, TileStore& store) {
  ArchiveReader in(bytes);
  if (const auto version = in.get<std::uint32_t>(); version != kVersion) {
    return failure(ErrorCode::input, "version " + std::to_string(version) + " instead of " + std::to_string(kVersion),
                   "map memory", "start the run anew");
  }
  const auto submaps = in.get<std::uint64_t>(), stops = in.get<std::uint64_t>(), tiles = in.get<std::uint64_t>();
  if (Status s = in.finish("map memory"); !s) return s;
  auto map = GlobalMap::from_store(options_.map, map_options_.cell_m, store);
  if (!map) return failure(map);
  if (map->submaps().size() != submaps || map->stops().size() != stops || map->tiles() != tiles)
    return failure(ErrorCode::store_damaged, "does not fit the map's tables", "map memory", "start the run anew");
  map_ = std::move(*map);
  return {};
}

}  // namespace spartan
