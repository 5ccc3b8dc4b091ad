#include "spartan/reconstruction/v_disparity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace spartan {
namespace {

// Heights above the plane are in units of the camera's height. Weights are relative to a score of 1, the fraction of
// the pixels of a range that lie at one height; all are empirical.
constexpr double kStep = 0.01;  // height step of the states
constexpr int kStates = 161;    // heights from −0.8 to 0.8
constexpr int kMiddle = kStates / 2;
constexpr double kChangePenalty = 0.02;  // penalty of a change of height by one step from knot to knot
constexpr double kPriorWeight = 0.01;    // penalty of one step of distance from the profile of the whole image
constexpr double kMeanSteps = 1.5;       // steps around the path over which the mean height is taken

// A pixel relative to the ground plane.
struct HeightRange {
  double height = 0;  // above the plane, m
  double range = 0;   // horizontal distance from the camera, along the plane, m
};

class HeightRangeMap {
 public:
  HeightRangeMap(const RectifiedStereo& geometry, const GroundPlane& plane) : g_(geometry), plane_(plane) {}
  HeightRange of(double u, double v, double d) const {
    const Eigen::Vector3d p = g_.triangulate(u, v, d);
    const double along = plane_.up.dot(p);
    return {plane_.height_m + along, (p - along * plane_.up).norm()};
  }

 private:
  const RectifiedStereo& g_;
  const GroundPlane& plane_;
};

double knot(double nearest, int i) {
  return nearest * std::pow(GroundProfile::kRatio, i);
}

int knot_before(double nearest, double range) {
  return static_cast<int>(std::floor(std::log(range / nearest) / std::log(GroundProfile::kRatio)));
}

// Histogram of the pixels of one strip over range and height.
struct Histogram {
  int knots = 0;
  std::vector<std::uint32_t> counts;  // knots × kStates
  std::vector<float> totals;

  explicit Histogram(int n)
      : knots(n), counts(static_cast<std::size_t>(n) * kStates), totals(static_cast<std::size_t>(n)) {}
  void add(int i, double height) {
    const auto s = static_cast<int>(std::lround(height / kStep)) + kMiddle;
    if (i < 0 || i >= knots || s < 0 || s >= kStates) return;
    ++counts[static_cast<std::size_t>(i) * kStates + static_cast<std::size_t>(s)];
    ++totals[static_cast<std::size_t>(i)];
  }
  void add(const Histogram& other) {
    for (std::size_t k = 0; k < counts.size(); ++k) counts[k] += other.counts[k];
    for (std::size_t k = 0; k < totals.size(); ++k) totals[k] += other.totals[k];
  }
  double count(int i, int s) const {
    return s < 0 || s >= kStates ? 0 : counts[static_cast<std::size_t>(i) * kStates + static_cast<std::size_t>(s)];
  }
  // Fraction of the pixels of a range that lie near a height.
  double fraction(int i, int s) const {
    const double total = totals[static_cast<std::size_t>(i)];
    return total < 1 ? 0 : (0.5 * count(i, s - 1) + count(i, s) + 0.5 * count(i, s + 1)) / total;
  }
};

// The path of bounded slope through a histogram with the highest score (Viterbi). `prior`, where it is not empty, is a
// path whose distance is penalized.
std::vector<int> best_path(const Histogram& histogram, const std::vector<int>& prior, double nearest, double height_m,
                           double steepest) {
  const auto unary_score = [&](int i, int s) {
    const double distance = prior.empty() ? 0 : std::abs(s - prior[static_cast<std::size_t>(i)]);
    return histogram.fraction(i, s) - kPriorWeight * distance;
  };
  std::vector<std::array<double, kStates>> scores(static_cast<std::size_t>(histogram.knots));
  std::vector<std::array<short, kStates>> from(static_cast<std::size_t>(histogram.knots));
  for (int s = 0; s < kStates; ++s) scores[0][static_cast<std::size_t>(s)] = unary_score(0, s);
  for (int i = 1; i < histogram.knots; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double rise = steepest * (knot(nearest, i) - knot(nearest, i - 1)) / (height_m * kStep);
    const int reach = std::max(1, static_cast<int>(rise));
    for (int s = 0; s < kStates; ++s) {
      double best = -std::numeric_limits<double>::infinity();
      int origin = s;
      for (int o = std::max(0, s - reach); o <= std::min(kStates - 1, s + reach); ++o) {
        const double score = scores[at - 1][static_cast<std::size_t>(o)] - kChangePenalty * std::abs(s - o);
        if (score > best) {
          best = score;
          origin = o;
        }
      }
      scores[at][static_cast<std::size_t>(s)] = best + unary_score(i, s);
      from[at][static_cast<std::size_t>(s)] = static_cast<short>(origin);
    }
  }
  std::vector<int> path(static_cast<std::size_t>(histogram.knots));
  const auto& last = scores.back();
  path.back() = static_cast<int>(std::max_element(last.begin(), last.end()) - last.begin());
  for (std::size_t i = path.size() - 1; i > 0; --i) path[i - 1] = from[i][static_cast<std::size_t>(path[i])];
  return path;
}

GroundProfile profile_along(const Histogram& histogram, const std::vector<int>& path, double nearest, double height_m) {
  GroundProfile profile;
  profile.nearest_m = nearest;
  profile.height_m.resize(path.size());
  const int reach = static_cast<int>(std::ceil(kMeanSteps));
  for (int i = 0; i < histogram.knots; ++i) {
    double sum = 0, weights = 0;
    for (int s = path[static_cast<std::size_t>(i)] - reach; s <= path[static_cast<std::size_t>(i)] + reach; ++s) {
      sum += histogram.count(i, s) * (s - kMiddle);
      weights += histogram.count(i, s);
    }
    const double state = weights > 0 ? sum / weights : path[static_cast<std::size_t>(i)] - kMiddle;
    profile.height_m[static_cast<std::size_t>(i)] = state * kStep * height_m;
  }
  return profile;
}

// Height of the ground at a column and a range, interpolated between the centres of the strips.
double ground_height(const std::vector<GroundProfile>& profiles, double u, int width, double range) {
  const double place = u / width * static_cast<double>(profiles.size()) - 0.5;
  const auto last = static_cast<double>(profiles.size() - 1);
  const double at = std::clamp(place, 0.0, last);
  const auto i = std::min(static_cast<std::size_t>(at), profiles.size() - 1);
  const std::size_t j = std::min(i + 1, profiles.size() - 1);
  const double weight = at - static_cast<double>(i);
  return (1 - weight) * profiles[i].at(range) + weight * profiles[j].at(range);
}

void compute_histogram(ImageView<const float> disparity, const RectifiedStereo& g, VDisparity& result) {
  const Eigen::Vector2d down = Eigen::Vector2d(-result.plane.up.x(), -result.plane.up.y()).normalized();
  const auto row_of = [&](double u, double v) { return down.dot(Eigen::Vector2d(u, v) - g.centre_px); };
  const double w = disparity.width() - 1, h = disparity.height() - 1;
  const std::array<double, 4> rows{row_of(0, 0), row_of(w, 0), row_of(0, h), row_of(w, h)};
  result.first_row_px = std::floor(*std::min_element(rows.begin(), rows.end()));
  float most = 1;
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      if (disparity(x, y) > most) most = disparity(x, y);
    }
  }
  const int height = static_cast<int>(*std::max_element(rows.begin(), rows.end()) - result.first_row_px) + 2;
  result.histogram = Image<std::uint16_t>(static_cast<int>(most / result.bin_px) + 1, height);
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      const double d = disparity(x, y);
      if (!(d > 0)) continue;
      std::uint16_t& bin = result.histogram(static_cast<int>(d / result.bin_px),
                                            static_cast<int>(std::lround(row_of(x, y) - result.first_row_px)));
      if (bin != 0xFFFF) ++bin;
    }
  }
}

}  // namespace

double GroundProfile::at(double range_m) const {
  // A knot covers the ranges up to the next one; its height belongs to their geometric mean.
  const double place = std::log(std::max(range_m, 1e-9) / nearest_m) / std::log(kRatio) - 0.5;
  const double at = std::clamp(place, 0.0, static_cast<double>(height_m.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(at), height_m.size() - 1);
  const std::size_t j = std::min(i + 1, height_m.size() - 1);
  const double weight = at - static_cast<double>(i);
  return (1 - weight) * height_m[i] + weight * height_m[j];
}

std::optional<VDisparity> compute_v_disparity(ImageView<const float> disparity, const RectifiedStereo& geometry,
                                              const GroundPlane& expected, const VDisparityOptions& options,
                                              const ThreadPool& workers, ImageView<const float> sigma) {
  const auto plane = find_ground_plane(disparity, geometry, expected, options.plane);
  if (!plane) return std::nullopt;
  VDisparity result;
  result.plane = *plane;
  const auto [w, h] = disparity.size();
  const HeightRangeMap height_range(geometry, *plane);
  // Ranges of the profile, in units of the camera's height; empirical.
  const double nearest = 0.1 * plane->height_m, farthest = 60 * plane->height_m;
  const int knots = knot_before(nearest, farthest) + 2, strips = options.strips;
  const double steepest = std::tan(options.max_slope_deg * std::numbers::pi / 180);
  std::vector<Histogram> histograms(static_cast<std::size_t>(strips), Histogram(knots));
  workers.parallel_for(0, strips, 1, [&](int from, int to) {
    for (int strip = from; strip < to; ++strip) {
      Histogram& histogram = histograms[static_cast<std::size_t>(strip)];
      for (int y = 0; y < h; ++y) {
        for (int x = w * strip / strips; x < w * (strip + 1) / strips; ++x) {
          const double d = disparity(x, y);
          if (!(d > 0)) continue;
          const HeightRange s = height_range.of(x, y, d);
          if (s.range > nearest) histogram.add(knot_before(nearest, s.range), s.height / plane->height_m);
        }
      }
    }
  });
  // The profile of the whole image is the prior of the strips: a large rock may fill a strip, but not the image.
  Histogram whole(knots);
  for (const Histogram& histogram : histograms) whole.add(histogram);
  const std::vector<int> prior_path = best_path(whole, {}, nearest, plane->height_m, steepest);
  result.profiles.resize(static_cast<std::size_t>(strips));
  workers.parallel_for(0, strips, 1, [&](int from, int to) {
    for (int strip = from; strip < to; ++strip) {
      const Histogram& histogram = histograms[static_cast<std::size_t>(strip)];
      const std::vector<int> path = best_path(histogram, prior_path, nearest, plane->height_m, steepest);
      result.profiles[static_cast<std::size_t>(strip)] = profile_along(histogram, path, nearest, plane->height_m);
    }
  });
  result.classes = Image<std::uint8_t>(w, h);
  workers.parallel_for(0, h, 16, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      for (int x = 0; x < w; ++x) {
        const double d = disparity(x, y);
        if (!(d > 0)) continue;
        const HeightRange s = height_range.of(x, y, d);
        const double over = s.height - ground_height(result.profiles, x, w, s.range);
        // height = h (1 − d₀/d), so ∂height/∂d = (h − height)/d.
        const double sigma_px = sigma.empty() ? options.plane.disparity_sigma_px : static_cast<double>(sigma(x, y));
        const double noise = std::abs(plane->height_m - s.height) / d * sigma_px;
        GroundClass kind = GroundClass::ground;
        if (over > options.obstacle_m + options.tolerance_sigmas * noise) kind = GroundClass::obstacle;
        if (over < -options.cavity_m - options.tolerance_sigmas * noise) kind = GroundClass::cavity;
        result.classes(x, y) = static_cast<std::uint8_t>(kind);
      }
    }
  });
  compute_histogram(disparity, geometry, result);
  return result;
}

}  // namespace spartan
