#include "spartan/camera/internal/flir_pan_tilt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <thread>

#include "spartan/testing/pan_tilt_emulator.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using testing::PanTiltEmulator;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kStep_rad = PanTiltEmulator::kStep_arcsec / 3600 * kDegree;

std::unique_ptr<PanTiltControl> open(const PanTiltEmulator& emulator) {
  auto unit = open_pan_tilt("flir:" + emulator.device());
  EXPECT_TRUE(unit) << unit.error().message();
  return unit ? std::move(*unit) : nullptr;
}

// Reads until the motion has ended.
Result<PanTiltReading> settle(PanTiltControl& unit) {
  for (int i = 0; i < 500; ++i) {
    auto reading = unit.read();
    if (!reading || !reading->moves) return reading;
    std::this_thread::sleep_for(2ms);
  }
  return failure(ErrorCode::read_error, "still moves");
}

TEST(FlirPanTilt, GoesWhereItIsSent) {
  const PanTiltEmulator emulator;
  const auto unit = open(emulator);
  ASSERT_TRUE(unit);
  for (const auto& [pan_deg, tilt_deg] : {std::pair{30.0, 20.0}, std::pair{-150.0, -10.0}, std::pair{0.0, 0.0}}) {
    ASSERT_TRUE(unit->move_to({pan_deg * kDegree, tilt_deg * kDegree}));
    const auto reading = settle(*unit);
    ASSERT_TRUE(reading) << reading.error().message();
    EXPECT_NEAR(reading->angles.pan_rad, pan_deg * kDegree, kStep_rad / 2 + 1e-12);
    EXPECT_NEAR(reading->angles.tilt_rad, tilt_deg * kDegree, kStep_rad / 2 + 1e-12);
    EXPECT_NEAR(emulator.position('P') * kStep_rad, -pan_deg * kDegree, kStep_rad) << "positions count to the right";
    EXPECT_NEAR(emulator.position('T') * kStep_rad, -tilt_deg * kDegree, kStep_rad) << "and upwards";
  }
  EXPECT_NEAR(unit->sigma_rad(), kStep_rad / std::sqrt(12.0), 1e-12);
}

TEST(FlirPanTilt, SaysThatItMoves) {
  const PanTiltEmulator emulator(2000);
  const auto unit = open(emulator);
  ASSERT_TRUE(unit);
  ASSERT_TRUE(unit->move_to({60 * kDegree, 0}));
  const auto reading = unit->read();
  ASSERT_TRUE(reading) << reading.error().message();
  EXPECT_TRUE(reading->moves);
  EXPECT_LT(reading->angles.pan_rad, 60 * kDegree);
  ASSERT_TRUE(settle(*unit));
}

TEST(FlirPanTilt, ALongMotionIsFollowedToItsEnd) {
  const PanTiltEmulator emulator(400);
  const auto unit = open(emulator);
  ASSERT_TRUE(unit);
  ASSERT_TRUE(unit->move_to({20 * kDegree, 5 * kDegree}));
  int moving = 0;
  double before_rad = -1;
  Result<PanTiltReading> reading = unit->read();
  for (; reading && reading->moves && moving < 1000; ++moving) {
    EXPECT_GE(reading->angles.pan_rad, before_rad);
    before_rad = reading->angles.pan_rad;
    std::this_thread::sleep_for(5ms);
    reading = unit->read();
  }
  ASSERT_TRUE(reading) << reading.error().message();
  EXPECT_GT(moving, 10) << "389 steps take a second";
  EXPECT_NEAR(reading->angles.pan_rad, 20 * kDegree, kStep_rad);
  EXPECT_NEAR(reading->angles.tilt_rad, 5 * kDegree, kStep_rad);
}

TEST(FlirPanTilt, GoesAtTheSpeedThatIsWanted) {
  PanTiltEmulator emulator;
  const double own = emulator.speed('P');
  {
    const auto unit = open(emulator);
    ASSERT_TRUE(unit);
    EXPECT_EQ(emulator.speed('P'), own) << "its own, where none is wanted";
  }
  auto opened = open_pan_tilt("flir:" + emulator.device() + "?pan_deg_s=50&tilt_deg_s=12.5");
  ASSERT_TRUE(opened) << opened.error().message();
  PanTiltControl& unit = **opened;
  EXPECT_NEAR(emulator.speed('P') * kStep_rad, 50 * kDegree, kStep_rad);
  EXPECT_NEAR(emulator.speed('T') * kStep_rad, 12.5 * kDegree, kStep_rad);
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(unit.move_to({20 * kDegree, 0}));
  ASSERT_TRUE(settle(unit));
  EXPECT_GT(std::chrono::steady_clock::now() - begin, 380ms) << "20 deg at 50 deg/s";

  emulator.lose_power(10ms);
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(emulator.speed('P'), own);
  EXPECT_FALSE(settle(unit)) << "it is not where it was sent";
  ASSERT_TRUE(unit.move_to({5 * kDegree, 0}));
  EXPECT_NEAR(emulator.speed('P') * kStep_rad, 50 * kDegree, kStep_rad) << "set again";
}

TEST(FlirPanTilt, KnowsTheLimitsOfItsSpeeds) {
  const PanTiltEmulator emulator;
  for (const char* speed : {"pan_deg_s=150", "pan_deg_s=1", "tilt_deg_s=150"}) {
    const auto unit = open_pan_tilt("flir:" + emulator.device() + "?" + speed);
    ASSERT_FALSE(unit) << speed;
    EXPECT_EQ(unit.error().code, ErrorCode::usage);
    EXPECT_THAT(unit.error().message(), HasSubstr("1.6 to 149.2 deg/s")) << speed;
  }
  EXPECT_TRUE(open_pan_tilt("flir:" + emulator.device() + "?pan_deg_s=149&tilt_deg_s=1.6"));
}

TEST(FlirPanTilt, AxesMayCountToTheOtherSide) {
  const PanTiltEmulator emulator;
  auto unit = open_pan_tilt("flir:" + emulator.device() + "?pan=1&tilt=1&baud=115200");
  ASSERT_TRUE(unit) << unit.error().message();
  ASSERT_TRUE((*unit)->move_to({30 * kDegree, 20 * kDegree}));
  ASSERT_TRUE(settle(**unit));
  EXPECT_GT(emulator.position('P'), 0);
  EXPECT_GT(emulator.position('T'), 0);
}

TEST(FlirPanTilt, KnowsItsLimits) {
  const PanTiltEmulator emulator;
  const auto unit = open(emulator);
  ASSERT_TRUE(unit);
  const Status moved = unit->move_to({170 * kDegree, 0});
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().code, ErrorCode::input);
  EXPECT_THAT(moved.error().message(), HasSubstr("-158.9 to 158.9 deg"));
  EXPECT_FALSE(unit->move_to({0, 50 * kDegree})) << "46.6 degrees downwards";
  EXPECT_TRUE(unit->move_to({0, 46 * kDegree}));
}

TEST(FlirPanTilt, SaysWhatTheUnitRefuses) {
  PanTiltEmulator emulator;
  const auto unit = open(emulator);
  ASSERT_TRUE(unit);
  emulator.refuse("Motor driver is disabled");
  const Status moved = unit->move_to({0.1, 0});
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().message(), HasSubstr("Motor driver is disabled"));
  EXPECT_TRUE(unit->move_to({0.1, 0})) << "it may be tried again";
  EXPECT_TRUE(settle(*unit));
}

TEST(FlirPanTilt, AsksAgainAndIgnoresGarbage) {
  PanTiltEmulator emulator;
  const auto unit = open(emulator);
  ASSERT_TRUE(unit);
  emulator.ignore(1);
  EXPECT_TRUE(unit->move_to({0.2, 0.1}));
  emulator.send_garbage(20);
  const auto reading = settle(*unit);
  ASSERT_TRUE(reading) << reading.error().message();
  EXPECT_NEAR(reading->angles.pan_rad, 0.2, kStep_rad);
}

TEST(FlirPanTilt, NoticesALossOfPowerAndGoesOn) {
  PanTiltEmulator emulator(2000);
  const auto unit = open(emulator);
  ASSERT_TRUE(unit);
  ASSERT_TRUE(unit->move_to({60 * kDegree, 10 * kDegree}));
  ASSERT_TRUE(unit->read());
  emulator.lose_power(100ms);
  const auto reading = settle(*unit);
  ASSERT_FALSE(reading);
  EXPECT_EQ(reading.error().code, ErrorCode::read_error);
  EXPECT_THAT(reading.error().message(), HasSubstr("loss of power"));
  ASSERT_TRUE(unit->move_to({60 * kDegree, 10 * kDegree}));
  const auto again = settle(*unit);
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_NEAR(again->angles.pan_rad, 60 * kDegree, kStep_rad);
}

TEST(FlirPanTilt, AUnitThatIsSilentIsAnError) {
  PanTiltEmulator emulator;
  const auto unit = open(emulator);
  ASSERT_TRUE(unit);
  emulator.lose_power(10s);
  const auto reading = unit->read();
  ASSERT_FALSE(reading);
  EXPECT_EQ(reading.error().code, ErrorCode::read_error);
  EXPECT_THAT(reading.error().message(), HasSubstr("does not answer 'PP'"));
}

TEST(FlirPanTilt, AnUnpluggedLineIsAnError) {
  auto emulator = std::make_unique<PanTiltEmulator>();
  const auto unit = open(*emulator);
  ASSERT_TRUE(unit);
  emulator.reset();
  const auto reading = unit->read();
  ASSERT_FALSE(reading);
  EXPECT_EQ(reading.error().code, ErrorCode::read_error);
}

// As an adapter of USB that comes back under the same name of /dev/serial/by-id, and is another device.
TEST(FlirPanTilt, ALineThatWasUnpluggedIsOpenedAgain) {
  const testing::TemporaryFolder folder;
  const std::string name = folder.path() + "/unit";
  auto first = std::make_unique<PanTiltEmulator>();
  std::filesystem::create_symlink(first->device(), name);
  const auto unit = open_pan_tilt("flir:" + name + "?pan_deg_s=50");
  ASSERT_TRUE(unit) << unit.error().message();
  const PanTiltEmulator second;
  first.reset();
  EXPECT_FALSE((*unit)->read());
  std::filesystem::remove(name);
  EXPECT_EQ((*unit)->move_to({0.2, 0.1}).error().code, ErrorCode::read_error) << "not there yet";
  EXPECT_FALSE((*unit)->read());
  std::filesystem::create_symlink(second.device(), name);
  const Status moved = (*unit)->move_to({0.2, 0.1});
  ASSERT_TRUE(moved) << moved.error().message();
  const auto reading = settle(**unit);
  ASSERT_TRUE(reading) << reading.error().message();
  EXPECT_NEAR(reading->angles.pan_rad, 0.2, kStep_rad);
  EXPECT_NEAR(second.speed('P') * kStep_rad, 50 * kDegree, kStep_rad);
}

TEST(PanTilt, AddressesAreChecked) {
  for (const char* address : {"/dev/ttyUSB0", "flir:", "flir:?baud=9600", "flir:/dev/x?baud=fast", "flir:/dev/x?pan=2",
                              "flir:/dev/x?speed=1", "flir:/dev/x?pan_deg_s=fast", "flir:/dev/x?tilt_deg_s=-1",
                              "flir:/dev/x?pan_deg_s=inf", "flir:/dev/x?pan_deg_s=", "flir:/dev/null?baud=12345"}) {
    const auto unit = open_pan_tilt(address);
    ASSERT_FALSE(unit) << address;
    EXPECT_EQ(unit.error().code, ErrorCode::usage) << address;
  }
  for (const char* device : {"/nowhere", "/dev/null"}) {
    const auto unit = open_pan_tilt(std::string("flir:") + device);
    ASSERT_FALSE(unit) << device;
    EXPECT_EQ(unit.error().code, ErrorCode::read_error) << device;
    EXPECT_THAT(unit.error().message(), HasSubstr(device));
  }
}

}  // namespace
}  // namespace spartan::internal
