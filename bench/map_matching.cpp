// Map matching from wrong initial poses, and the reduction of drift by map merging. `make bench-map_matching`.
//
//   map_matching [--from FOLDER] [--noise FOLDER] [--scratch FOLDER] [--trials N] [--seed N]
//     [--set key=value,…] [--verbose 1] [--ground NAME,…] [PART...]
//
// PART: wrong_start (on the recordings of --ground), flat, drift (default: all). The recordings come from
// scripts/recordings; --noise: the same stops with another noise seed, from scripts/recordings_with_other_noise.
// --scratch: folder of the cached points of stops.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/numerics/random.h"
#include "spartan/slam/global_map.h"
#include "spartan/slam/internal/map_refinement.h"
#include "spartan/slam/map_merger.h"
#include "standard_recordings.h"
#include "stop_points.h"

namespace spartan {

using namespace internal;
namespace {

using Clock = std::chrono::steady_clock;

// Adds the time since `start` and resets `start`.
void accumulate_time(Clock::time_point& start, double& sum) {
  const auto now = Clock::now();
  sum += std::chrono::duration<double>(now - start).count();
  start = now;
}

const ThreadPool kWorkers(2);
MatchOptions g_options;

struct StopWithMap {
  StopPoints points;
  LocalMap map;  // at the true pose
};

using Stops = std::vector<StopWithMap>;

Stops load(const std::string& recording, const std::string& cache) {
  Stops stops;
  for (StopPoints& points : points_of_stops(recording, cache)) {
    LocalMap map = MapGenerator::create({}, kWorkers)->generate(points.points, points.world_from_body);
    stops.push_back({std::move(points), std::move(map)});
  }
  return stops;
}

int known_cells(const LocalMap& map) {
  int known = 0;
  for (int y = 0; y < map.size().height; ++y) {
    for (int x = 0; x < map.size().width; ++x) known += map.count(x, y) > 0 ? 1 : 0;
  }
  return known;
}

GlobalMap build(const std::vector<const StopWithMap*>& stops) {
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  for (const StopWithMap* stop : stops) {
    static_cast<void>(
        map.add(stop->map, stop->points.stamp, {stop->points.world_from_body, Matrix6d::Zero()}, Matrix6d::Zero()));
  }
  return map;
}

MapView view_around(GlobalMap& map, const Pose& pose) {
  return *map.view(window_around(pose.translation().x(), pose.translation().y(), 5, 0.05));
}

double overlap_of(const LocalMap& local, GlobalMap& map) {
  const MapView view = *map.view(window_of(local.place, local.size()));
  int both = 0;
  for (int y = 0; y < local.size().height; ++y) {
    for (int x = 0; x < local.size().width; ++x) both += local.count(x, y) > 0 && view.count(x, y) > 0 ? 1 : 0;
  }
  return static_cast<double>(both) / known_cells(local);
}

// An incoming stop and the stops that the global map is built from.
struct Setting {
  std::string scenario;
  std::size_t incoming;
  std::vector<const StopWithMap*> others;
  const StopWithMap* stop;
  double overlap = 0;
};

struct Class {
  std::string name;
  double low, high;
  std::vector<Setting> settings;
};

// Uniformly distributed in a ball.
Eigen::Vector3d in_ball(Random& random, double radius) {
  for (;;) {
    const Eigen::Vector3d v(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    if (v.norm() <= 1) return radius * v;
  }
}

Matrix6d covariance_of(double radius_m, double radius_rad) {
  Matrix6d m = Matrix6d::Zero();  // uniform in a ball: variance r²/5 along each axis
  m.diagonal() << Eigen::Vector3d::Constant(radius_m * radius_m / 5),
      Eigen::Vector3d::Constant(radius_rad * radius_rad / 5);
  return m;
}

struct Outcome {
  MapMatch match;
  double error_m = 0, error_deg = 0, nees = 0, seconds = 0;
};

Outcome attempt(const Setting& setting, const Vector6d& offset, bool verbose) {
  GlobalMap map = build(setting.others);
  const Pose truth = setting.stop->points.world_from_body;
  const UncertainPose prior{moved(truth, truth.translation(), offset),
                            covariance_of(0.3, 5 * spartan::kRadiansPerDegree)};
  const MapView view = view_around(map, prior.pose);
  auto start = Clock::now();
  Outcome o;
  const LocalMap local = MapGenerator::create({}, kWorkers)->generate(setting.stop->points.points, prior.pose);
  o.match = match_map(setting.stop->points.points, local, view, prior, MapOptions().min_points, g_options, kWorkers);
  accumulate_time(start, o.seconds);
  const Pose error = truth.inverse() * o.match.world_from_body;
  o.error_m = error.translation().norm();
  o.error_deg = rotation_angle(error) / spartan::kRadiansPerDegree;
  const Vector6d xi = log_se3(o.match.world_from_body.inverse() * truth);
  o.nees = xi.dot(o.match.information * xi);
  if (verbose) {
    fmt::print(
        "{:<16} {:>2} overlap {:.2f} {:<10} error {:6.1f} mm {:5.2f} deg sigma {:5.1f} mm {:5.2f} deg nees {:6.1f} det "
        "{} "
        "cells {} blocks {} misfit {:.2f} lead {:.1f} cand {} {:.2f} s\n",
        setting.scenario, setting.incoming, setting.overlap, name_of(o.match.status), 1000 * o.error_m, o.error_deg,
        1000 * o.match.sigma_m, o.match.sigma_rad / spartan::kRadiansPerDegree, o.nees, o.match.determined,
        o.match.cells, o.match.blocks, o.match.normalized_residual, o.match.margin, o.match.candidates, o.seconds);
  }
  return o;
}

// All choices of other stops, classified by the fraction of the incoming map that they overlap.
void add_settings(const std::string& scenario, const Stops& stops, const Stops& repeated, std::vector<Class>& classes) {
  const std::vector<std::vector<int>> earlier{{-1}, {-2}, {-3}, {-1, -2}, {-2, -3}},
      around{{-1, 1}, {-2, 1}, {-1, 2}, {-2, 2}, {-2, -1, 1, 2}};
  const auto choose = [&](std::size_t i, const std::vector<int>& steps) {
    std::vector<const StopWithMap*> others;
    for (const int step : steps) {
      const int k = static_cast<int>(i) + step;
      if (k >= 0 && k < static_cast<int>(stops.size())) others.push_back(&stops[static_cast<std::size_t>(k)]);
    }
    return others.size() == steps.size() ? others : std::vector<const StopWithMap*>{};
  };
  const auto add = [&](std::size_t i, const std::vector<const StopWithMap*>& others, const std::vector<int>& into) {
    if (others.empty()) return;
    GlobalMap map = build(others);
    const double overlap = overlap_of(stops[i].map, map);
    for (const int c : into) {
      Class& of = classes[static_cast<std::size_t>(c)];
      if (overlap >= of.low && overlap < of.high) of.settings.push_back({scenario, i, others, &stops[i], overlap});
    }
  };
  for (std::size_t i = 0; i < stops.size(); ++i) {
    for (const auto& steps : earlier) add(i, choose(i, steps), {0, 1});
    for (const auto& steps : around) add(i, choose(i, steps), {2});
    if (i < repeated.size()) add(i, {&repeated[i]}, {3});
  }
}

struct Tally {
  int trials = 0, recovered = 0, false_success = 0;
  std::map<std::string, int> verdicts;
  std::vector<double> errors_m, errors_deg, nees, seconds;
  void add(const Outcome& o) {
    ++trials;
    const bool accurate = o.error_m <= 0.02 && o.error_deg <= 0.5;
    recovered += o.match.decided() && accurate ? 1 : 0;
    false_success += o.match.decided() && o.error_m > 0.1 ? 1 : 0;
    ++verdicts[std::string(name_of(o.match.status))];
    seconds.push_back(o.seconds);
    if (!o.match.decided()) return;
    errors_m.push_back(o.error_m);
    errors_deg.push_back(o.error_deg);
    nees.push_back(o.nees);
  }
};

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())))];
}

void print(const std::string& name, const Tally& t) {
  double nees = 0;
  for (const double n : t.nees) nees += n / static_cast<double>(t.nees.size());
  std::string verdicts;
  for (const auto& [verdict, count] : t.verdicts) verdicts += fmt::format(" {} {}", count, verdict);
  fmt::print(
      "| {} | {} | {} = {:.1f} % | {} | {:.1f}, {:.1f}, {:.1f} mm | {:.2f}, {:.2f}, {:.2f} deg | {:.1f} ({:.1f}) | "
      "{:.2f} s |{} |\n",
      name, t.trials, t.recovered, 100.0 * t.recovered / std::max(t.trials, 1), t.false_success,
      1000 * quantile(t.errors_m, 0.5), 1000 * quantile(t.errors_m, 0.95), 1000 * quantile(t.errors_m, 1),
      quantile(t.errors_deg, 0.5), quantile(t.errors_deg, 0.95), quantile(t.errors_deg, 1), nees, quantile(t.nees, 0.5),
      quantile(t.seconds, 0.5), verdicts);
  std::fflush(stdout);
}

struct Recordings {
  std::string from, noise, scratch;
  Stops stops(const std::string& name) const { return load(from + "/" + name, scratch + "/" + name); }
  Stops repeated(const std::string& name) const {
    return noise.empty() ? Stops{} : load(noise + "/" + name, scratch + "/again_" + name);
  }
};

void wrong_start(const Recordings& recordings, const std::vector<std::string>& names, int trials, int seed,
                 bool verbose) {
  std::vector<Class> classes{{"15-30 %, earlier stops", 0.15, 0.30, {}},
                             {"30-46 %, earlier stops", 0.30, 0.46, {}},
                             {"46-80 %, both sides", 0.46, 0.80, {}},
                             {"80-100 %, same stop, other noise", 0.80, 1.01, {}}};
  std::vector<Stops> stops, repeated;
  stops.reserve(names.size());
  repeated.reserve(names.size());
  for (const std::string& name : names) {
    stops.push_back(recordings.stops(name));
    repeated.push_back(recordings.repeated(name));
    add_settings(name, stops.back(), repeated.back(), classes);
  }
  Tally all;
  std::map<std::string, Tally> by_scenario;
  Random random(static_cast<std::uint64_t>(seed), 5);
  fmt::print(
      "| overlap | trials | recovered | success beyond 10 cm | error: median, 95 %, largest | angle | NEES mean "
      "(median) | time | verdicts |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  for (const Class& c : classes) {
    if (c.settings.empty()) {
      fmt::print("| {} | none |\n", c.name);
      continue;
    }
    Tally tally;
    for (int i = 0; i < trials / static_cast<int>(classes.size()); ++i) {
      const Setting& setting = c.settings[random.below(static_cast<std::uint32_t>(c.settings.size()))];
      Vector6d offset;
      offset << in_ball(random, 0.3), in_ball(random, 5 * spartan::kRadiansPerDegree);
      const Outcome o = attempt(setting, offset, verbose);
      tally.add(o);
      all.add(o);
      by_scenario[setting.scenario].add(o);
    }
    print(fmt::format("{} ({} settings)", c.name, c.settings.size()), tally);
  }
  print("all", all);
  for (const auto& [name, tally] : by_scenario) print(name, tally);
}

void flat(const Recordings& recordings, int trials, bool verbose) {
  const Stops stops = recordings.stops("flat_featureless"), repeated = recordings.repeated("flat_featureless");
  struct Kind {
    std::string name;
    std::vector<int> steps;
  };
  for (const Kind& kind : {Kind{"the stop before", {-1}}, Kind{"all stops before", {-4, -3, -2, -1}},
                           Kind{"both sides", {-1, 1}}, Kind{"same stop, other noise", {}}}) {
    Tally tally;
    Random random(2011, 6);
    for (int i = 0; i < trials; ++i) {
      const std::size_t k = random.below(static_cast<std::uint32_t>(stops.size()));
      Setting setting{"flat_featureless", k, {}, &stops[k], 0};
      for (const int step : kind.steps) {
        const int other = static_cast<int>(k) + step;
        if (other >= 0 && other < static_cast<int>(stops.size()))
          setting.others.push_back(&stops[static_cast<std::size_t>(other)]);
      }
      if (kind.steps.empty() && k < repeated.size()) setting.others.push_back(&repeated[k]);
      Vector6d offset;
      offset << in_ball(random, 0.3), in_ball(random, 5 * spartan::kRadiansPerDegree);
      if (setting.others.empty()) continue;
      tally.add(attempt(setting, offset, verbose));
    }
    print("flat_featureless, " + kind.name, tally);
  }
}

// Root mean square position error; the first poses are equal.
double ate_of(const std::vector<Pose>& poses, const Stops& stops) {
  double squares = 0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    squares += (poses[i].translation() - stops[i].points.world_from_body.translation()).squaredNorm();
  return std::sqrt(squares / static_cast<double>(poses.size()));
}

Pose step_between(const Stops& stops, std::size_t i) {
  return stops[i - 1].points.world_from_body.inverse() * stops[i].points.world_from_body;
}

// Odometry alone: true motions, each composed with its error.
std::vector<Pose> drifted(const Stops& stops, const std::vector<Vector6d>& errors, double scale) {
  std::vector<Pose> poses{stops.front().points.world_from_body};
  for (std::size_t i = 1; i < stops.size(); ++i)
    poses.push_back(poses.back() * step_between(stops, i) * exp_se3(scale * errors[i]));
  return poses;
}

// Every motion has a random error of 15 mm (1 % of its length) along each axis and half a degree about each, scaled so
// that the drift over the whole loop is the published one, an ATE of 1.25 %.
void drift(const Recordings& recordings, int seeds, bool verbose) {
  const Stops stops = recordings.stops("loop");
  double length = 0;
  for (std::size_t i = 1; i < stops.size(); ++i) length += step_between(stops, i).translation().norm();
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(0.015), Eigen::Vector3d::Constant(0.5 * spartan::kRadiansPerDegree);
  fmt::print("loop, {:.1f} m between {} stops; odometry errors scaled to an ATE of 1.25 % = {:.3f} m\n", length,
             stops.size(), 0.0125 * length);
  fmt::print(
      "| seed | ATE odometry | ATE map merging | reduction | decided | largest error of a decided step "
      "|\n|---|---|---|---|---|---|\n");
  double sum = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), 7);
    std::vector<Vector6d> errors(stops.size());
    for (Vector6d& error : errors) {
      for (int k = 0; k < 6; ++k) error[k] = sigma[k] * random.normal();
    }
    double low = 0, high = 20;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (ate_of(drifted(stops, errors, middle), stops) < 0.0125 * length ? low : high) = middle;
    }
    const double scale = low;
    const Matrix6d covariance = (scale * sigma).cwiseAbs2().asDiagonal();
    SlamOptions options;
    options.match = g_options;
    MapMerger merger = MapMerger::create(options, {}, kWorkers).value();
    UncertainPose at{stops.front().points.world_from_body, Matrix6d::Zero()};
    std::vector<Pose> poses;
    int decided = 0;
    double worst = 0;
    for (std::size_t i = 0; i < stops.size(); ++i) {
      if (i > 0) at = compose(at, {step_between(stops, i) * exp_se3(scale * errors[i]), covariance});
      const auto result = merger.add(stops[i].points.points, stops[i].points.stamp, at);
      if (!result) return;
      if (result->decided() && i > 0) {
        const Pose wrong = step_between(stops, i).inverse() * poses.back().inverse() * result->corrected.pose;
        worst = std::max(worst, wrong.translation().norm());
      }
      if (verbose) {
        const Pose off = stops[i].points.world_from_body.inverse() * result->corrected.pose;
        const Vector6d xi = log_se3(off);
        fmt::print(
            "  {:>2} {:<10} error before {:6.1f} mm, corrected {:6.1f} mm {:5.2f} deg, sigma {:.1f} mm, nees {:.1f}\n",
            i, name_of(result->match.status),
            1000 * (at.pose.translation() - stops[i].points.world_from_body.translation()).norm(),
            1000 * off.translation().norm(), rotation_angle(off) / spartan::kRadiansPerDegree,
            1000 * std::sqrt(result->corrected.covariance.diagonal().head<3>().maxCoeff()),
            i == 0 ? 0.0 : xi.dot(result->corrected.covariance.inverse() * xi));
      }
      decided += result->decided() ? 1 : 0;
      at = result->corrected;
      poses.push_back(at.pose);
    }
    const double before = ate_of(drifted(stops, errors, scale), stops), after = ate_of(poses, stops);
    sum += 1 - after / before;
    fmt::print("| {} | {:.3f} m | {:.3f} m | {:.1f} % | {} of {} | {:.1f} mm |\n", seed, before, after,
               100 * (1 - after / before), decided, stops.size() - 1, 1000 * worst);
    std::fflush(stdout);
  }
  fmt::print("| mean | | | {:.1f} % | | |\n", 100 * sum / seeds);
}

std::vector<std::string> parts_of(std::string list) {
  std::vector<std::string> parts;
  while (!list.empty()) {
    const auto comma = list.find(',');
    parts.push_back(list.substr(0, comma));
    list = comma == std::string::npos ? "" : list.substr(comma + 1);
  }
  return parts;
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--scratch", "/tmp/spartan_map_matching"},
                                                        {"--noise", ""},
                                                        {"--trials", "300"},
                                                        {"--verbose", "0"},
                                                        {"--set", ""},
                                                        {"--ground", "rocky_20pct,loop,crater_rim,diffuse_200lux"},
                                                        {"--seed", "2011"}});
  for (const std::string& set : parts_of(arguments.options.at("--set"))) g_options = *set_option(g_options, set);
  const Recordings recordings{arguments.folder, arguments.options.at("--noise"), arguments.options.at("--scratch")};
  const bool verbose = arguments.number("--verbose") != 0;
  const auto wanted = [&](const std::string& part) {
    return arguments.scenarios.empty() ||
           std::find(arguments.scenarios.begin(), arguments.scenarios.end(), part) != arguments.scenarios.end();
  };
  if (wanted("wrong_start")) {
    wrong_start(recordings, parts_of(arguments.options.at("--ground")), arguments.number("--trials"),
                arguments.number("--seed"), verbose);
  }
  if (wanted("drift")) drift(recordings, std::max(1, arguments.number("--trials") / 30), verbose);
  if (wanted("flat")) flat(recordings, arguments.number("--trials") / 10, verbose);
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
