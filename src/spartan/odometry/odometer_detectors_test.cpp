// The odometry with each of the detectors.
#include <gtest/gtest.h>

#include "spartan/odometry/internal/synthetic_drive_test.h"

namespace spartan {

using namespace synthetic_drive;

namespace {

TEST(OdometerDetectors, EachMeasuresASyntheticDriveAndResumes) {
  for (const char* choice : {"detection.detector=surf", "detection.detector=harris", "detection.detector=orb",
                             "detection.detector=sift", "detection.detector=akaze", "detection.surf.refine=true"}) {
    const OdometryOptions options = set_option(OdometryOptions{}, choice).value();
    Odometer odometer = Odometer::create(options, ThreadPool(2)).value();
    Pose travelled;
    Bytes half;
    for (int i = 0; i < 10; ++i) {
      const MotionEstimate e = odometer.add(pair_of(i));
      EXPECT_EQ(e.status, TrackingStatus::tracking) << choice << ": " << e.reason;
      if (i > 0) {
        EXPECT_GT(e.inliers, 50) << choice;
      }
      travelled = travelled * e.previous_from_current;
      if (i == 5) half = odometer.save();
    }
    EXPECT_LT((true_motion(0, 9).inverse() * travelled).translation().norm(), 0.004) << choice;
    Odometer resumed = Odometer::create(options, ThreadPool(1)).value();
    ASSERT_TRUE(resumed.restore(half).has_value()) << choice;
    for (int i = 6; i < 10; ++i) resumed.add(pair_of(i));
    EXPECT_EQ(resumed.save(), odometer.save()) << choice;
  }
}

// Without patches, matches are those of descriptors.
TEST(OdometerDetectors, DescriptorsAloneMeasureALargeMotion) {
  for (const char* detector : {"surf", "harris", "orb", "sift", "akaze"}) {
    OdometryOptions options = set_option(OdometryOptions{}, std::string("detection.detector=") + detector).value();
    options.matching.correlation = false;
    Odometer odometer = Odometer::create(options, ThreadPool(1)).value();
    odometer.add(pair_of(0));
    const MotionEstimate e = odometer.add(pair_of(frame_of(3), 1));
    EXPECT_NE(e.status, TrackingStatus::lost) << detector << ": " << e.reason;
    EXPECT_LT(translation_error(e, 0, 3), 0.02) << detector;
  }
}

}  // namespace
}  // namespace spartan
