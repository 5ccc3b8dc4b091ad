// Cost of a frame of visual odometry, beside Lucas-Kanade with PnP and SIFT of OpenCV in the same run.
// `make bench-odometry`.
//
//   odometry [--frames N] [--first FRAME] [--points N] [RECORDING...]
//
// --points: maximum number of features of an image where detectors are compared (1200).
// RECORDING: a folder; default: kitti_06 and euroc_v101 of SPARTAN_DATA, rocky_20pct of the standard recordings. The
// rectified images of the first pair are in memory: neither reading nor rectification is timed.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <opencv2/core/utility.hpp>
#include <opencv2/features2d.hpp>
#include <string>
#include <vector>

#include "odometry_rival.h"
#include "spartan/camera/recording.h"
#include "spartan/core/threads.h"
#include "spartan/image_io/opencv_bridge.h"
#include "spartan/imaging/imager.h"
#include "spartan/numerics/median.h"
#include "spartan/odometry/internal/detection/landmark_detector.h"
#include "spartan/odometry/odometer.h"
#include "standard_recordings.h"
#include "timing.h"

namespace spartan {
namespace {

struct Frame {
  RectifiedPair pair;
  Image<std::uint8_t> left, right, left_mask, right_mask;
};

std::vector<Frame> load(const std::string& recording, int from, int count) {
  const auto source = open_recording(recording);
  if (!source) {
    fmt::print("{}: skipped: {}\n", recording, source.error().message());
    return {};
  }
  const Rig& rig = (*source)->info().rig;
  auto imager = Imager::create(rig, ImagingOptions(), ThreadPool(2));
  if (!imager) return {};
  const auto pair =
      std::find_if(rig.pairs.begin(), rig.pairs.end(), [](const StereoPair& p) { return p.for_odometry; });
  if (pair == rig.pairs.end()) return {};
  std::vector<Frame> frames;
  const std::vector<Stamp> stamps = (*source)->listed_stamps(pair->name);
  for (std::size_t i = static_cast<std::size_t>(from); i < stamps.size() && static_cast<int>(frames.size()) < count;
       ++i) {
    const auto frame = (*source)->frame_at(pair->name, stamps[i]);
    if (!frame) continue;
    const auto rectified = imager->process(*frame);
    if (!rectified) continue;
    Frame f{*rectified, Image<std::uint8_t>::copy_of(rectified->left), Image<std::uint8_t>::copy_of(rectified->right),
            Image<std::uint8_t>::copy_of(rectified->left_mask), Image<std::uint8_t>::copy_of(rectified->right_mask)};
    frames.push_back(std::move(f));
    frames.back().pair.times.clear();
  }
  for (Frame& f : frames) {
    f.pair.left = f.left;
    f.pair.right = f.right;
    f.pair.left_mask = f.left_mask;
    f.pair.right_mask = f.right_mask;
  }
  return frames;
}

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

struct Costs {
  std::vector<double> wall, cpu;
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  void print(const std::string& name, int frames) const {
    fmt::print("  {:<34} wall {:>6.2f} ms (95 % {:>6.2f})  CPU {:>6.2f} ms  of {} frames, end {:.3f} {:.3f} {:.3f} m\n",
               name, median(wall), quantile(wall, 0.95), median(cpu), frames, end.x(), end.y(), end.z());
  }
};

template <class Add>
Costs time_frames(const std::vector<Frame>& frames, Add add) {
  Costs costs;
  Pose pose;
  for (const Frame& f : frames) {
    const double before = cpu_ms();
    costs.wall.push_back(milliseconds([&] { pose = pose * add(f.pair); }));
    costs.cpu.push_back(cpu_ms() - before);
  }
  costs.end = pose.translation();
  return costs;
}

void time_odometer(const std::vector<Frame>& frames, int threads) {
  Odometer odometer = Odometer::create(OdometryOptions(), ThreadPool(threads)).value();
  std::vector<double> detect, reconstruct, match, estimate;
  int lost = 0, tracked = 0;
  const Costs costs = time_frames(frames, [&](const RectifiedPair& pair) {
    const MotionEstimate e = odometer.add(pair);
    detect.push_back(e.times.detect);
    reconstruct.push_back(e.times.reconstruct);
    match.push_back(e.times.match);
    estimate.push_back(e.times.estimate);
    lost += e.status == TrackingStatus::lost ? 1 : 0;
    tracked += e.inliers;
    return e.previous_from_current;
  });
  costs.print(fmt::format("Spartan, {} thread{}", threads, threads > 1 ? "s" : ""), static_cast<int>(frames.size()));
  fmt::print("  {:<34} detect {:.2f}, reconstruct {:.2f}, match {:.2f}, estimate {:.2f} ms; {} lost, {} inliers\n", "",
             median(detect), median(reconstruct), median(match), median(estimate), lost,
             tracked / static_cast<int>(frames.size()));
}

// SURF as the odometry uses it, and oriented and refined, beside SIFT of OpenCV for as many points.
void compare_detectors(const std::vector<Frame>& frames, int points) {
  DetectionOptions plain;
  plain.landmarks = points;
  DetectionOptions refined = plain;
  refined.surf.upright = false;
  refined.surf.refine = true;
  const std::array detectors{internal::make_landmark_detector(plain, ThreadPool(1)),
                             internal::make_landmark_detector(refined, ThreadPool(1))};
  std::array<std::vector<double>, 2> surf;
  std::array<std::size_t, 2> surf_count{};
  std::vector<double> sift;
  std::size_t sift_count = 0;
  const auto opencv = cv::SIFT::create(plain.landmarks, 3, plain.sift.threshold);
  for (std::size_t i = 0; i < std::min<std::size_t>(frames.size(), 11); ++i) {
    const auto& left = frames[i].left;
    const cv::Mat image = as_mat(left.view());
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    sift.push_back(milliseconds([&] { opencv->detectAndCompute(image, cv::noArray(), keypoints, descriptors); }));
    sift_count = keypoints.size();
    for (std::size_t k = 0; k < detectors.size(); ++k)
      surf[k].push_back(milliseconds([&] { surf_count[k] = detectors[k]->detect(left, {}).size(); }));
  }
  for (std::size_t k = 0; k < detectors.size(); ++k) {
    fmt::print("  {:<34} {:.2f} ms ({}), OpenCV SIFT {:.2f} ms ({}), one thread: {:.1f} times as fast\n",
               k == 0 ? "SURF, detect and describe" : "SURF, oriented and refined", median(surf[k]), surf_count[k],
               median(sift), sift_count, median(sift) / median(surf[k]));
  }
}

void compare(const std::string& recording, int from, int count, int points) {
  const std::vector<Frame> frames = load(recording, from, count);
  if (frames.empty()) return;
  const ImageSize size = frames[0].pair.left.size();
  fmt::print("{}, {} x {}\n", recording.substr(recording.rfind('/') + 1), size.width, size.height);
  time_odometer(frames, 2);
  time_odometer(frames, 1);
  cv::setNumThreads(1);
  LucasKanadeOdometry rival;
  time_frames(frames, [&](const RectifiedPair& pair) {
    return rival.add(pair);
  }).print("OpenCV Lucas-Kanade and PnP", static_cast<int>(frames.size()));

  compare_detectors(frames, points);
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--frames", "60"}, {"--first", "0"}, {"--points", "1200"}});
  if (arguments.scenarios.empty()) {
    const char* const data = std::getenv("SPARTAN_DATA");
    if (data != nullptr) arguments.scenarios = {std::string(data) + "/kitti_06", std::string(data) + "/euroc_v101"};
    arguments.scenarios.push_back(arguments.folder + "/rocky_20pct");
  }
  for (const std::string& recording : arguments.scenarios)
    compare(recording, arguments.number("--first"), arguments.number("--frames"), arguments.number("--points"));
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
