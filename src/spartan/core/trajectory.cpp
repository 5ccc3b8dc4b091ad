#include "spartan/core/trajectory.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <string_view>

#include "spartan/core/files.h"

namespace spartan {
namespace {

struct Line {
  std::string where;  // "file:line"
  std::vector<std::string_view> words;
  bool has_commas = false;
};

// The lines that are neither empty nor comments, split at white space and commas.
std::vector<Line> split(std::string_view text, const std::string& name) {
  std::vector<Line> lines;
  int number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    Line parsed{fmt::format("{}:{}", name, number), {}, line.find(',') != std::string_view::npos};
    while (!line.empty()) {
      const std::size_t begin = line.find_first_not_of(" \t\r,");
      if (begin == std::string_view::npos) break;
      line.remove_prefix(begin);
      const std::size_t stop = std::min(line.find_first_of(" \t\r,"), line.size());
      parsed.words.push_back(line.substr(0, stop));
      line.remove_prefix(stop);
    }
    if (!parsed.words.empty() && parsed.words.front().front() != '#') lines.push_back(std::move(parsed));
  }
  return lines;
}

template <std::size_t Count>
Result<std::array<double, Count>> numbers(const Line& line, std::size_t from) {
  std::array<double, Count> values{};
  for (std::size_t i = 0; i < Count; ++i) {
    std::string_view word = line.words[from + i];
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), values[i]);
    if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(values[i])) {
      return failure(ErrorCode::input, fmt::format("'{}' is not a finite number", word), line.where);
    }
  }
  return values;
}

Result<Pose> pose_from(const Line& line, const Eigen::Vector3d& t, const Eigen::Quaterniond& q) {
  constexpr double kTolerance = 1e-2;  // for quaternions rounded to a few digits
  if (std::abs(q.norm() - 1.0) > kTolerance)
    return failure(ErrorCode::input, "the quaternion does not have unit length", line.where);
  return Pose(q, t);
}

Status check_order(const Trajectory& trajectory, const Line& line) {
  const std::size_t n = trajectory.size();
  if (n >= 2 && trajectory[n - 1].stamp <= trajectory[n - 2].stamp) {
    return failure(ErrorCode::input, "the time stamp is not later than the previous one", line.where,
                   "sort the file by time");
  }
  return {};
}

Status not_empty(const Trajectory& trajectory, const std::string& name) {
  if (trajectory.empty()) return failure(ErrorCode::input, "contains no poses", name);
  return {};
}

Result<std::vector<Stamp>> read_times(const std::string& path) {
  const auto text = read_file(path);
  if (!text) return failure(text);
  std::vector<Stamp> stamps;
  for (const Line& line : split(*text, path)) {
    const auto stamp = parse_decimal_seconds(line.words.front());
    if (!stamp) return failure(ErrorCode::input, stamp.error().what, line.where);
    stamps.push_back(*stamp);
  }
  return stamps;
}

}  // namespace

std::string to_tum(const Trajectory& trajectory) {
  std::string text;
  for (const auto& [stamp, pose] : trajectory) {
    const auto& t = pose.translation();
    const auto& q = pose.rotation();
    text += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f} {:.12f}\n", to_decimal_seconds(stamp), t.x(),
                        t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

std::string to_kitti(const Trajectory& trajectory) {
  std::string text;
  for (const auto& entry : trajectory) {
    const Eigen::Matrix4d m = entry.pose.matrix();
    for (int i = 0; i < 12; ++i) text += fmt::format("{}{:.12e}", i == 0 ? "" : " ", m(i / 4, i % 4));
    text += '\n';
  }
  return text;
}

std::string to_euroc(const Trajectory& trajectory) {
  std::string text = "#timestamp [ns],px [m],py [m],pz [m],qw [],qx [],qy [],qz []\n";
  for (const auto& [stamp, pose] : trajectory) {
    const auto& t = pose.translation();
    const auto& q = pose.rotation();
    text += fmt::format("{},{:.9f},{:.9f},{:.9f},{:.12f},{:.12f},{:.12f},{:.12f}\n", stamp.ns, t.x(), t.y(), t.z(),
                        q.w(), q.x(), q.y(), q.z());
  }
  return text;
}

Result<Trajectory> parse_tum(const std::string& text, const std::string& name) {
  Trajectory trajectory;
  for (const Line& line : split(text, name)) {
    if (line.words.size() != 8) {
      return failure(ErrorCode::input,
                     fmt::format("{} values, a TUM line must have 8: t tx ty tz qx qy qz qw", line.words.size()),
                     line.where);
    }
    const auto stamp = parse_decimal_seconds(line.words[0]);
    if (!stamp) return failure(ErrorCode::input, stamp.error().what, line.where);
    const auto v = numbers<7>(line, 1);
    if (!v) return failure(v);
    const auto& a = *v;
    const auto pose = pose_from(line, {a[0], a[1], a[2]}, {a[6], a[3], a[4], a[5]});
    if (!pose) return failure(pose);
    trajectory.push_back({*stamp, *pose});
    if (const Status order = check_order(trajectory, line); !order) return failure(order);
  }
  if (const Status some = not_empty(trajectory, name); !some) return failure(some);
  return trajectory;
}

Result<Trajectory> parse_kitti(const std::string& text, const std::string& name, const std::vector<Stamp>& stamps) {
  Trajectory trajectory;
  const std::vector<Line> lines = split(text, name);
  if (!stamps.empty() && stamps.size() < lines.size()) {
    return failure(ErrorCode::input,
                   fmt::format("{} poses but only {} time stamps in times.txt", lines.size(), stamps.size()), name);
  }
  for (const Line& line : lines) {
    if (line.words.size() != 12) {
      return failure(ErrorCode::input, fmt::format("{} values, a KITTI line must have 12", line.words.size()),
                     line.where);
    }
    const auto v = numbers<12>(line, 0);
    if (!v) return failure(v);
    Eigen::Matrix3d rotation;
    Eigen::Vector3d translation;
    for (int i = 0; i < 12; ++i) {
      if (i % 4 == 3) {
        translation[i / 4] = (*v)[static_cast<std::size_t>(i)];
      } else {
        rotation(i / 4, i % 4) = (*v)[static_cast<std::size_t>(i)];
      }
    }
    if (!is_rotation(rotation, 1e-3))
      return failure(ErrorCode::input, "the left 3×3 part is not a rotation matrix", line.where);
    const std::size_t index = trajectory.size();
    const Stamp stamp = stamps.empty() ? Stamp{static_cast<std::int64_t>(index) * 1'000'000'000} : stamps[index];
    trajectory.push_back({stamp, Pose(nearest_rotation(rotation), translation)});
    if (const Status order = check_order(trajectory, line); !order) return failure(order);
  }
  if (const Status some = not_empty(trajectory, name); !some) return failure(some);
  return trajectory;
}

Result<Trajectory> parse_euroc(const std::string& text, const std::string& name) {
  Trajectory trajectory;
  for (const Line& line : split(text, name)) {
    if (line.words.size() < 8) {
      return failure(ErrorCode::input,
                     fmt::format("{} values, an EuRoC line must have at least 8: ns,p,q", line.words.size()),
                     line.where);
    }
    std::int64_t ns = 0;
    const std::string_view word = line.words[0];
    if (const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), ns);
        error != std::errc{} || end != word.data() + word.size()) {
      return failure(ErrorCode::input, fmt::format("'{}' is not a time in nanoseconds", word), line.where);
    }
    const auto v = numbers<7>(line, 1);
    if (!v) return failure(v);
    const auto& a = *v;
    const auto pose = pose_from(line, {a[0], a[1], a[2]}, {a[3], a[4], a[5], a[6]});
    if (!pose) return failure(pose);
    trajectory.push_back({Stamp{ns}, *pose});
    if (const Status order = check_order(trajectory, line); !order) return failure(order);
  }
  if (const Status some = not_empty(trajectory, name); !some) return failure(some);
  return trajectory;
}

Result<LoadedTrajectory> load_trajectory(const std::string& path) {
  const auto text = read_file(path);
  if (!text) return failure(text);
  const std::vector<Line> lines = split(*text, path);
  if (lines.empty()) return failure(ErrorCode::input, "contains no poses", path);

  LoadedTrajectory loaded;
  Result<Trajectory> poses;
  if (lines.front().words.size() == 12) {
    loaded.format = TrajectoryFormat::kitti;
    const std::string times = (std::filesystem::path(path).parent_path() / "times.txt").string();
    std::vector<Stamp> stamps;
    std::error_code unreadable;
    if (std::filesystem::exists(times, unreadable)) {
      auto read = read_times(times);
      if (!read) return failure(read);
      stamps = std::move(*read);
    }
    loaded.has_stamps = !stamps.empty();
    poses = parse_kitti(*text, path, stamps);
  } else if (lines.front().has_commas) {
    loaded.format = TrajectoryFormat::euroc;
    poses = parse_euroc(*text, path);
  } else {
    loaded.format = TrajectoryFormat::tum;
    poses = parse_tum(*text, path);
  }
  if (!poses) return failure(poses);
  loaded.poses = std::move(*poses);
  loaded.has_rotation = false;
  for (const StampedPose& entry : loaded.poses) loaded.has_rotation |= rotation_angle(entry.pose) > 1e-9;
  return loaded;
}

double path_length(const Trajectory& trajectory) {
  double length = 0;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    length += (trajectory[i].pose.translation() - trajectory[i - 1].pose.translation()).norm();
  }
  return length;
}

}  // namespace spartan
