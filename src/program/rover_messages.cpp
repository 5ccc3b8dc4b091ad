#include "program/rover_messages.h"

#include <cmath>

#include "program/json.h"
#include "spartan/core/time.h"
#include "spartan/system/run_folder.h"

namespace spartan::program {
namespace {

Json vector_of(const Eigen::Vector3d& v) {
  return Json::array({number(v.x()), number(v.y()), number(v.z())});
}

Json pose_of(const Pose& pose) {
  const Eigen::Quaterniond& q = pose.rotation();
  return {{"position_m", vector_of(pose.translation())},
          {"orientation_xyzw", Json::array({number(q.x()), number(q.y()), number(q.z()), number(q.w())})}};
}

// With the standard deviations of the right perturbation, translation and rotation, in the body frame.
Json pose_of(const UncertainPose& pose) {
  Json json = pose_of(pose.pose);
  const Vector6d sigma = pose.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  json["sigma_m"] = vector_of(sigma.head<3>());
  json["sigma_rad"] = vector_of(sigma.tail<3>());
  return json;
}

Json message(const char* type, Stamp stamp) {
  return {{"schema", 1}, {"type", type}, {"stamp_ns", stamp.ns}};
}

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string pose_message(const LocalizationEstimate& estimate) {
  Json json = message("pose", estimate.stamp);
  json["world_from_body"] = pose_of(estimate.world_from_body);
  json["odom_from_body"] = pose_of(estimate.odom_from_body.pose);
  json["velocity_m_s"] = vector_of(estimate.velocity_m_s);
  return line_of(json);
}

std::string health_message(const FrameRecord& frame) {
  Json json = message("health", frame.stamp);
  json["frame_id"] = frame.frame_id;
  json["odometry"] = frame.status;
  json["fault"] = frame.fault;
  json["message"] = frame.message;
  json["inliers"] = frame.motion.inliers;
  json["latency_ms"] = frame.latency_ms ? number(*frame.latency_ms) : Json(nullptr);
  Json sensors = Json::object();
  if (frame.localization) {
    for (const LocalizationRecord::Sensor& sensor : frame.localization->sensors) {
      sensors[sensor.name] = {{"state", sensor.state}, {"reason", sensor.reason}};
      if (sensor.test) sensors[sensor.name].update({{"nis", sensor.test->nis}, {"gate", sensor.test->gate}});
    }
  }
  json["sensors"] = sensors;
  json["wheel_slip"] = frame.localization ? number(frame.localization->slip) : Json(nullptr);
  return line_of(json);
}

std::string map_message(const MappedStop& stop, bool has_files) {
  Json json = message("map", stop.stamp);
  json["position_id"] = stop.position_id;
  json["views"] = stop.views;
  json["match"] = name_of(stop.merged.match.status);
  json["overlap"] = number(stop.merged.match.overlap);
  json["obstacles"] = stop.merged.local.obstacles.size();
  json["world_from_body"] = pose_of(stop.merged.corrected);
  json["file"] = has_files ? Json(RunFolder{"."}.local_map(stop.stamp).substr(2) + ".tif") : Json(nullptr);
  return line_of(json);
}

std::string panorama_message(const PanoramaEvent& event) {
  Json json = message("panorama", event.stamp);
  json["state"] = event.begins ? "begins" : "ended";
  json["position_id"] = event.position_id;
  json["views"] = event.views;
  return line_of(json);
}

}  // namespace spartan::program
