// Real images with the true calibration, and with a fault planted in it: `rig inspect` names it, and the rig it writes
// is correct. All faults, without the program: src/spartan/calibration/planted_faults_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "program.h"
#include "spartan/calibration/internal/model_modification.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {

using namespace internal;
namespace {

using nlohmann::json;
using testing::run_program;

class PlantedCalibrationFaults : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(data_)) GTEST_SKIP() << "no k10_pair; SPARTAN_DATA says where it is";
  }

  json inspect(const Rig& rig, const std::string& corrected) const {
    const auto result = run_program({"rig", "inspect", folder_.write("rig.yaml", to_rig_yaml(rig)),
                                     data_ + "/left4.png", data_ + "/right4.png", "--json", "--apply", corrected});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out)["pairs"].front();
  }

  const std::string data_ = testing::data_folder() + "/k10_pair";
  testing::TemporaryFolder folder_;
  Rig rig_ = read_rig(testing::source_folder() + "/config/rigs/k10_corrected.yaml").value();
};

TEST_F(PlantedCalibrationFaults, None) {
  const std::string corrected = folder_.path() + "/corrected.yaml";
  const json found = inspect(rig_, corrected);
  EXPECT_EQ(found["verdict"], "good") << found["findings"];
  EXPECT_EQ(*read_rig(corrected), rig_) << "nothing is changed where nothing is wrong";
}

TEST_F(PlantedCalibrationFaults, RowOffset) {
  Rig planted = rig_;
  for (Camera& camera : planted.cameras) {
    if (camera.name == planted.pairs[0].right) camera.model = with_row_offset(camera.model, 2);
  }
  const std::string corrected = folder_.path() + "/corrected.yaml";
  const json found = inspect(planted, corrected);
  EXPECT_EQ(found["verdict"], "bad");
  EXPECT_EQ(found["findings"].front()["id"], "row_offset");
  const auto rig = read_rig(corrected);
  ASSERT_TRUE(rig) << rig.error().message();
  const json again = inspect(*rig, folder_.path() + "/again.yaml");
  EXPECT_EQ(again["verdict"], "good") << again["findings"];
  EXPECT_NEAR(again["row_error_px"]["after"]["mean"].get<double>(),
              found["row_error_px"]["corrected"]["mean"].get<double>(), 0.1)
      << "the figures are those of the rig that is written";
}

}  // namespace
}  // namespace spartan
