// Tiny recordings in every layout, written file by file so that tests can corrupt them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan::testing {

inline constexpr ImageSize kTinySize{24, 16};

/// An image of uniform noise.
Image<std::uint8_t> tiny_image(std::uint64_t seed, ImageSize size = kTinySize);
/// The same image as a file; creates its parent folders.
void write_tiny_png(const std::string& path, std::uint64_t seed, ImageSize size = kTinySize);

/// A rig of two parallel cameras "left" and "right" of kTinySize, pair "stereo".
Rig tiny_rig();

/// KITTI odometry: calib.txt, times.txt, image_0, image_1. Frame i has images of the seeds 2 i and 2 i + 1.
void write_tiny_kitti(const TemporaryFolder& folder, int frames, double period_s = 0.1);
/// KITTI raw: calib_cam_to_cam.txt, image_00, image_01; without IMU.
void write_tiny_kitti_raw(const TemporaryFolder& folder, int frames);
/// EuRoC below mav0: cam0 and cam1 with images at these time stamps; without IMU.
void write_tiny_euroc(const TemporaryFolder& folder, const std::vector<std::int64_t>& left_ns,
                      const std::vector<std::int64_t>& right_ns);
/// Spartan: recording.yaml, rig.yaml, frames.csv, images/stereo.
void write_tiny_spartan(const TemporaryFolder& folder, int frames, double period_s = 0.1);

/// All samples of a source, by kind and in the order of arrival.
struct CollectedSamples {
  std::vector<Sample> all;
  std::vector<StereoFrame> frames;
  std::vector<MissingFrame> missing;
  std::string error;  ///< that ended the reading; empty at the end of the source
};
CollectedSamples collect_samples(Recording& source);

/// Frame ids of the frames, or of the missing frames.
std::vector<std::int64_t> ids_of(const std::vector<StereoFrame>& frames);
std::vector<std::int64_t> ids_of(const std::vector<MissingFrame>& missing);

/// Whether format and pixels are equal.
bool same_image(const FrameImage& a, const FrameImage& b);

}  // namespace spartan::testing
