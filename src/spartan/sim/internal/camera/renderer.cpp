#include "spartan/sim/internal/camera/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace spartan::sim::internal {
namespace {

constexpr float kFarthest_m = 400;        // beyond the corner of the horizon square
constexpr float kShadowOffset_m = 2e-4F;  // shadow rays start above the surface, against self-intersection
constexpr int kMaxAlbedoSamples = 4;      // along an elongated footprint
constexpr int kReach_px = 2;              // support of the point spread function: four standard deviations

// Which of the four points of the sun and poses ray (column, row) uses: every pixel and every block of four pixels
// uses all of them.
int sample_index(int column, int row) {
  const int in_pixel = 2 * (row & 1) + (column & 1), of_pixel = 2 * (row >> 1 & 1) + (column >> 1 & 1);
  return in_pixel ^ of_pixel;
}

std::vector<float> point_spread(int side) {
  std::vector<double> spread;
  double sum = 0;
  for (int k = -kReach_px * side; k < (kReach_px + 1) * side; ++k) {
    const double offset = (k + 0.5) / side - 0.5;
    spread.push_back(std::exp(-0.5 * offset * offset / (Renderer::kPointSpread_px * Renderer::kPointSpread_px)));
    sum += spread.back();
  }
  std::vector<float> weights;
  weights.reserve(spread.size());
  for (const double w : spread) weights.push_back(static_cast<float>(w / sum));
  return weights;
}

Eigen::Vector3f direction_at(const Camera& camera, double u, double v) {
  const auto ray = unproject(camera.model, {u, v});
  return ray ? Eigen::Vector3f(ray->direction.cast<float>()) : Eigen::Vector3f(0, 0, 0);
}

// Intersections of a packet, for shading.
struct Hits {
  HitPacket at;
  std::array<Eigen::Vector3f, kPacket> look;
  std::array<bool, kPacket> hit;
  std::uint32_t lit = 0;
  std::array<float, kPacket> albedo{}, rover_albedo{};  // rover: 0 where a ray does not hit it

  Material material(int k) const {
    if (rover_albedo[static_cast<std::size_t>(k)] > 0) return Material::rover;
    return at.rock[k] ? Material::rock : Material::soil;
  }
};

// Soil and rocks scatter by the law of SoilOptions; paint and metal of the rover by Lambert's.
double reflectance(const Soil& soil, Material material, double cos_incidence, double cos_emission) {
  if (material == Material::rover) return std::max(cos_incidence, 0.0);
  return soil.reflectance(cos_incidence, cos_emission);
}

// Albedos of a packet. A footprint is elongated by 1/cos of the emission angle: it is averaged over up to
// kMaxAlbedoSamples points along it, each filtered to its part.
void find_albedos(const LitScene& s, const Eigen::Vector3d& camera_centre, double radians_per_ray, Hits& h) {
  constexpr std::size_t kMost = static_cast<std::size_t>(kPacket) * kMaxAlbedoSamples;
  struct List {
    std::array<double, kMost> x{}, y{}, footprint{}, albedo{};
    std::array<int, kMost> ray{};
    std::size_t count = 0;
    Soil::Places places() const { return {{x.data(), count}, {y.data(), count}, {footprint.data(), count}}; }
  };
  std::array<List, 2> lists;  // ground, rocks
  std::array<int, kPacket> parts{};
  for (int k = 0; k < kPacket; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (h.rover_albedo[i] > 0) h.albedo[i] = h.rover_albedo[i];
    if (!h.hit[i] || h.rover_albedo[i] > 0) continue;
    const Eigen::Vector3f n(h.at.normal_x[k], h.at.normal_y[k], h.at.normal_z[k]);
    const Eigen::Vector3f& look = h.look[i];
    const double distance = h.at.distance[k], across = distance * radians_per_ray;
    const double along = across / std::max(0.05, static_cast<double>(-n.dot(look)));
    const int count = std::clamp(static_cast<int>(std::lround(along / across)), 1, kMaxAlbedoSamples);
    parts[i] = count;
    const Eigen::Vector3d place = camera_centre + distance * look.cast<double>();
    const Eigen::Vector3d stretch = along * (look - look.dot(n) * n).normalized().cast<double>();
    const bool rock = h.at.rock[k];
    List& list = lists[rock ? 1 : 0];
    for (int part = 0; part < count; ++part) {
      const Eigen::Vector3d p = place + ((part + 0.5) / count - 0.5) * stretch;
      list.x[list.count] = rock ? p.x() + 0.6 * p.z() : p.x();
      list.y[list.count] = rock ? p.y() - 0.8 * p.z() : p.y();
      list.footprint[list.count] = std::max(across, along / count);
      list.ray[list.count++] = k;
    }
  }
  if (lists[0].count > 0) s.soil.ground_albedo(lists[0].places(), {lists[0].albedo.data(), lists[0].count});
  if (lists[1].count > 0) s.soil.rock_albedo(lists[1].places(), {lists[1].albedo.data(), lists[1].count});
  for (const List& list : lists) {
    for (std::size_t m = 0; m < list.count; ++m) {
      const auto i = static_cast<std::size_t>(list.ray[m]);
      h.albedo[i] += static_cast<float>(list.albedo[m] / parts[i]);
    }
  }
}

}  // namespace

namespace {

Pose interpolated(const Pose& top, const Pose& bottom, double part) {
  return {top.rotation().slerp(part, bottom.rotation()), (1 - part) * top.translation() + part * bottom.translation()};
}

}  // namespace

Pose ShutterPose::at(double part) const {
  return rolls ? interpolated(top, bottom, part) : top;
}

ExposurePoses ShutterPoses::at(double part) const {
  if (!rolls) return top;
  ExposurePoses poses;
  for (std::size_t t = 0; t < poses.size(); ++t) poses[t] = interpolated(top[t], bottom[t], part);
  return poses;
}

Exposing at_rest(const Pose& world_from_camera) {
  Exposing exposing;
  exposing.world_from_camera.top.fill(world_from_camera);
  return exposing;
}

Sampling Sampling::of(int per_pixel) {
  switch (per_pixel) {
    case 1:
      return {1, false};
    case 2:
      return {2, true};
    case 4:
      return {2, false};
    case 9:
      return {3, false};
    case 16:
      return {4, false};
    default:
      throw std::invalid_argument("Sampling: rays per pixel must be 1, 2, 4, 9 or 16");
  }
}

// One row of the supersampled image, all materials.
struct Renderer::Row {
  std::array<float*, kMaterials> values{};
  bool split = false;
  void put(int column, Material material, double luminance) {
    if (split) {
      for (float* value : values) value[column] = 0;
      values[static_cast<std::size_t>(material)][column] = static_cast<float>(luminance);
    } else {
      values[0][column] = static_cast<float>(luminance);
    }
  }
};

Renderer::Renderer(const Camera& camera, const Sampling& sampling)
    : camera_(camera), sampling_(sampling), border_(kReach_px * sampling.side) {
  const int side = sampling.side;
  width_ = (camera.size.width * side + 2 * border_ + 2 * kPacket - 1) / (2 * kPacket) * (2 * kPacket);
  height_ = camera.size.height * side + 2 * border_;
  directions_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int j = 0; j < height_; ++j) {
    for (int i = 0; i < width_; ++i) {
      directions_.push_back(direction_at(camera, (i - border_ + 0.5) / side - 0.5, (j - border_ + 0.5) / side - 0.5));
    }
  }
  const double cx = 0.5 * camera.size.width, cy = 0.5 * camera.size.height;
  const Eigen::Vector3f a = direction_at(camera, cx, cy), b = direction_at(camera, cx + 1, cy);
  radians_per_ray_ = std::atan2(a.cross(b).norm(), a.dot(b)) / static_cast<float>(side);
}

std::int64_t Renderer::rays() const {
  return static_cast<std::int64_t>(width_) * height_ / (sampling_.every_other ? 2 : 1);
}

// Poses that the rays of one row use.
struct Renderer::RowPoses {
  std::array<Eigen::Matrix3f, kTimes> rotations;
  std::array<Eigen::Vector3f, kTimes> centres;  // relative to the scene's origin
  Eigen::Vector3d middle;                       // of the camera, world
  ExposurePoses body_from_origin;
};

Renderer::RowPoses Renderer::poses_of_row(const LitScene& s, const Exposing& exposing, int row) const {
  const double part = std::clamp((row - border_ + 0.5) / (height_ - 2 * border_), 0.0, 1.0);
  const ExposurePoses camera = exposing.world_from_camera.at(part);
  RowPoses poses;
  for (std::size_t t = 0; t < kTimes; ++t) {
    poses.rotations[t] = camera[t].rotation().toRotationMatrix().cast<float>();
    poses.centres[t] = (camera[t].translation() - s.scene.origin()).cast<float>();
  }
  poses.middle = camera[kTimes / 2].translation();
  if (exposing.rover) {
    const ExposurePoses body = exposing.world_from_body.at(part);
    for (std::size_t t = 0; t < kTimes; ++t)
      poses.body_from_origin[t] = body[t].inverse() * Pose::from_translation(s.scene.origin());
  }
  return poses;
}

void Renderer::shade_row(const LitScene& s, const Exposing& exposing, int row, Row& out) const {
  const RowPoses poses = poses_of_row(s, exposing, row);
  const Eigen::Vector3f* const directions =
      directions_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
  const int step = sampling_.every_other ? 2 : 1;
  const double bounce_lux = s.soil.mean_albedo() * s.sun.horizontal_lux(s.sky_lux);
  for (int first = sampling_.every_other ? row & 1 : 0; first < width_; first += kPacket * step) {
    RayPacket rays, shadows;
    RoverBody::Poses bodies{};
    Hits h;
    for (int k = 0; k < kPacket; ++k) {
      const int column = first + k * step;
      const auto t = static_cast<std::size_t>(sample_index(column, row));
      const Eigen::Vector3f& direction = directions[column];
      h.look[static_cast<std::size_t>(k)] = poses.rotations[t] * direction;
      bodies[static_cast<std::size_t>(k)] = &poses.body_from_origin[t];
      rays.set(k, poses.centres[t], h.look[static_cast<std::size_t>(k)], direction.z() != 0 ? kFarthest_m : -1.0F);
    }
    h.at = s.scene.intersect(rays);
    if (exposing.rover) h.rover_albedo = exposing.rover->intersect(rays, bodies, h.at);
    for (int k = 0; k < kPacket; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const Eigen::Vector3f n(h.at.normal_x[k], h.at.normal_y[k], h.at.normal_z[k]);
      const Eigen::Vector3f& towards_sun = s.sun.direction(sample_index(first + k * step, row));
      h.hit[i] = std::isfinite(h.at.distance[k]);
      const bool faces_sun = h.hit[i] && s.sun.lux() > 0 && n.dot(towards_sun) > 0;
      const Eigen::Vector3f origin(rays.origin_x[k], rays.origin_y[k], rays.origin_z[k]);
      const Eigen::Vector3f place =
          h.hit[i] ? Eigen::Vector3f(origin + h.at.distance[k] * h.look[i] + kShadowOffset_m * n) : origin;
      shadows.set(k, place, towards_sun, faces_sun ? kFarthest_m : -1.0F);
      h.lit |= faces_sun ? 1U << k : 0U;
    }
    if (h.lit != 0) h.lit &= ~s.scene.occluded(shadows);
    if (h.lit != 0 && exposing.rover) h.lit &= ~exposing.rover->occluded(shadows, bodies);
    find_albedos(s, poses.middle, radians_per_ray_, h);
    for (int k = 0; k < kPacket; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const int column = first + k * step;
      if (!h.hit[i]) {
        out.put(column, Material::sky, s.sky_lux / std::numbers::pi);
        continue;
      }
      const Eigen::Vector3f n(h.at.normal_x[k], h.at.normal_y[k], h.at.normal_z[k]);
      const Eigen::Vector3d place = poses.middle + static_cast<double>(h.at.distance[k]) * h.look[i].cast<double>();
      const Material material = h.material(k);
      const double view_factor = s.sky.view_factor(place, n.z());
      const double emission = -n.dot(h.look[i]);
      const double cos_sun = n.dot(s.sun.direction(sample_index(column, row)));
      const double sun = (h.lit >> k & 1U) != 0 ? s.sun.lux() * reflectance(s.soil, material, cos_sun, emission) : 0.0;
      // One bounce: what occludes the sky is ground with the radiance of open level ground.
      const double around = s.sky_lux * view_factor + bounce_lux * (1 - view_factor);
      out.put(column, material, h.albedo[i] * (sun + around) / std::numbers::pi);
    }
  }
}

// Fills rays that were skipped with the mean of their four neighbours.
void fill_every_other(Image<float>& fine) {
  for (int y = 0; y < fine.height(); ++y) {
    for (int x = 1 - (y & 1); x < fine.width(); x += 2) {
      const int left = x > 0 ? x - 1 : x + 1, right = x + 1 < fine.width() ? x + 1 : x - 1;
      const int above = y > 0 ? y - 1 : y + 1, below = y + 1 < fine.height() ? y + 1 : y - 1;
      fine(x, y) = 0.25F * ((fine(left, y) + fine(right, y)) + (fine(x, above) + fine(x, below)));
    }
  }
}

Image<float> Renderer::filtered(const Image<float>& fine, const ThreadPool& workers) const {
  const std::vector<float> weights = point_spread(sampling_.side);
  const int taps = static_cast<int>(weights.size()), side = sampling_.side;
  const auto [w, h] = camera_.size;
  Image<float> upright(width_, h), result(w, h);
  workers.parallel_for(0, h, 16, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      float* const row = upright.row(y);
      std::fill_n(row, width_, 0.0F);
      for (int k = 0; k < taps; ++k) {
        const float weight = weights[static_cast<std::size_t>(k)];
        const float* const source = fine.row(y * side + k);
        for (int x = 0; x < width_; ++x) row[x] += weight * source[x];
      }
      for (int x = 0; x < w; ++x) {
        float sum = 0;
        for (int k = 0; k < taps; ++k) sum += weights[static_cast<std::size_t>(k)] * row[x * side + k];
        result(x, y) = sum;
      }
    }
  });
  return result;
}

LuminanceImage Renderer::render(const LitScene& scene, const Pose& world_from_camera, bool split_materials,
                                const ThreadPool& workers) const {
  return render(scene, at_rest(world_from_camera), split_materials, workers);
}

LuminanceImage Renderer::render(const LitScene& scene, const Exposing& exposing, bool split_materials,
                                const ThreadPool& workers) const {
  const std::size_t planes = split_materials ? kMaterials : 1;
  std::array<Image<float>, kMaterials> fine;
  for (std::size_t m = 0; m < planes; ++m) fine[m] = Image<float>(width_, height_);
  workers.parallel_for(0, height_, 8, [&](int from, int to) {
    for (int row = from; row < to; ++row) {
      Row out;
      out.split = split_materials;
      for (std::size_t m = 0; m < planes; ++m) out.values[m] = fine[m].row(row);
      shade_row(scene, exposing, row, out);
    }
  });
  LuminanceImage luminance;
  luminance.split = split_materials;
  for (std::size_t m = 0; m < planes; ++m) {
    if (sampling_.every_other) fill_every_other(fine[m]);
    luminance.by_material[m] = filtered(fine[m], workers);
  }
  return luminance;
}

double Renderer::mean_luminance(const LitScene& scene, const Exposing& exposing, int step) const {
  std::vector<float> values(static_cast<std::size_t>(width_));
  Row row;
  row.values[0] = values.data();
  double sum = 0;
  std::int64_t count = 0;
  for (int j = border_; j < height_ - border_; j += step * sampling_.side) {
    shade_row(scene, exposing, j, row);
    const int every = sampling_.every_other ? 2 : 1;
    for (int i = sampling_.every_other ? j & 1 : 0; i < width_; i += every) {
      sum += values[static_cast<std::size_t>(i)];
      ++count;
    }
  }
  return sum / static_cast<double>(count);
}

Image<float> render_depth(const Camera& camera, const GroundScene& scene, const Pose& world_from_camera,
                          const ThreadPool& workers) {
  const auto [w, h] = camera.size;
  const Eigen::Matrix3f rotation = world_from_camera.rotation().toRotationMatrix().cast<float>();
  const Eigen::Vector3d from_origin = world_from_camera.translation() - scene.origin();
  const Eigen::Vector3f centre = from_origin.cast<float>();
  Image<float> result(w, h, std::numeric_limits<float>::quiet_NaN());
  workers.parallel_for(0, h, 8, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      for (int first = 0; first < w; first += kPacket) {
        RayPacket rays;
        std::array<float, kPacket> along{};
        for (int k = 0; k < kPacket; ++k) {
          const Eigen::Vector3f direction =
              first + k < w ? direction_at(camera, first + k, y) : Eigen::Vector3f(0, 0, 0);
          along[static_cast<std::size_t>(k)] = direction.z();
          rays.set(k, centre, rotation * direction, direction.z() != 0 ? kFarthest_m : -1.0F);
        }
        const HitPacket hits = scene.intersect(rays);
        for (int k = 0; k < kPacket && first + k < w; ++k) {
          if (std::isfinite(hits.distance[k]))
            result(first + k, y) = hits.distance[k] * along[static_cast<std::size_t>(k)];
        }
      }
    }
  });
  return result;
}

}  // namespace spartan::sim::internal
