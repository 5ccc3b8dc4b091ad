// `spartan run` on a drive with stops: maps, all sensors, resuming after a kill during a stop.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <variant>
#include <vector>

#include "program.h"
#include "run_results.h"
#include "spartan/camera/recording.h"
#include "spartan/rig/rig.h"
#include "spartan/slam/tile_store.h"
#include "spartan/storage/database.h"
#include "spartan/storage/geotiff.h"
#include "spartan/system/run.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using testing::byte_stable_content;
using testing::ProgramLimits;
using testing::ProgramResult;
using testing::run_program;

// Each test works on its own copy of the recording and of its finished run, "whole".
class Stops : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::copy(testing::small_runs_folder() + "/stops", folder_.path(), fs::copy_options::recursive);
    if (!fs::exists(path("rec"))) GTEST_SKIP() << "built without Embree";
  }
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  ProgramResult run(const std::string& output, std::vector<std::string> more = {},
                    const ProgramLimits& limits = {}) const {
    std::vector<std::string> words{"run", path("rec"), "-o", path(output)};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words, limits);
  }
  static bool finished(const ProgramResult& result) { return result.exit_code == 0 || result.exit_code == 6; }
  std::vector<std::string> maps_of(const std::string& output) const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path(output) + "/maps")) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("local_") && name.ends_with(".tif")) names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Stops, AreMappedAndAllSensorsAreUsed) {
  const auto summary = nlohmann::json::parse(testing::content_of(path("whole/summary.json")));
  EXPECT_EQ(summary["world"]["gravity"], "measured");
  EXPECT_EQ(summary["world"]["heading"], "east");
  for (const char* sensor : {"imu", "wheels", "compass", "inclinometer"}) {
    EXPECT_GT(summary["health"]["localization"][sensor]["ok"], 0) << sensor;
  }
  EXPECT_TRUE(fs::exists(path("whole/trajectory_localization.tum")));
  const auto maps = maps_of("whole");
  ASSERT_EQ(maps.size(), 2u) << "two stops";
  const auto map = read_geotiff(path("whole/maps/") + maps[1]);
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_EQ(map->names.front(), "elevation_m");
  EXPECT_EQ(map->bands.front().width(), 150) << "1.5 m, the range of cameras of 96 px";
}

// The recording ends at the second stop: no frame of the odometry pair follows its pans.
TEST_F(Stops, EveryFrameAndStopIsTimed) {
  std::string table = testing::content_of(path("rec/frames.csv"));
  table.erase(table.rfind('\n', table.size() - 2) + 1);
  std::ofstream(path("rec/frames.csv")) << table;
  const auto frames = std::count(table.begin(), table.end(), '\n') - 1;
  const auto times_run = [&](const std::string& output, const std::string& stage) {
    const auto summary = nlohmann::json::parse(testing::content_of(path(output + "/summary.json")));
    return summary["stages"][stage]["count"].get<int>();
  };
  ASSERT_TRUE(finished(run("out", {"--set", "stop_delay_frames=0"})));
  for (const char* stage : {"camera", "imaging"}) EXPECT_EQ(times_run("out", stage), frames) << stage;
  for (const char* stage : {"mapping", "slam", "maps"}) EXPECT_EQ(times_run("out", stage), 2) << stage << ", two stops";
  ASSERT_TRUE(finished(run("part", {"--max-frames", "3", "--set", "stop_delay_frames=0"})));
  EXPECT_EQ(times_run("part", "maps"), 1) << "the second stop is not finished";
  ASSERT_TRUE(finished(run("part", {"--resume", "--set", "stop_delay_frames=0"})));
  EXPECT_EQ(byte_stable_content(path("part")), byte_stable_content(path("out")));
  ASSERT_TRUE(finished(run("no_maps", {"--set", "maps=false"})));
  EXPECT_EQ(times_run("no_maps", "camera"), frames);
}

// The views of a stop are no frames of the odometry: what was computed for them belongs to the next one.
TEST_F(Stops, ARunInterruptedAfterAnySampleEndsAsIfItWasNot) {
  std::vector<int> after{1};
  const auto recording = open_recording(path("rec"));
  ASSERT_TRUE(recording) << recording.error().message();
  int samples = 0;
  for (auto read = (*recording)->read({}); read && read->sample; read = (*recording)->read({})) {
    ++samples;
    const auto* frame = std::get_if<StereoFrame>(&*read->sample);
    if (frame != nullptr && frame->pair == "wide") after.insert(after.end(), {samples, samples + 1});
  }
  ASSERT_GE(after.size(), 9u) << "two stops";
  const auto run_until = [&](const std::string& output, int last, bool resume) {
    RunRequest request;
    request.input = path("rec");
    request.output = path(output);
    request.resume = resume;
    RunHooks hooks;
    int asked = 0;
    hooks.should_stop = [&] { return asked++ >= last; };
    const auto outcome = spartan::run(request, hooks);
    ASSERT_TRUE(outcome) << outcome.error().message();
    EXPECT_EQ(outcome->interrupted, last < samples);
  };
  run_until("undisturbed", samples + 1, false);
  const auto undisturbed = byte_stable_content(path("undisturbed"));
  EXPECT_EQ(undisturbed.at("run.sqlite").find("== innovations\n=="), std::string::npos)
      << "the innovations of the sensors, too, are compared";
  for (const int last : after) {
    if (last >= samples) continue;
    const std::string output = fmt::format("after_{}", last);
    run_until(output, last, false);
    run_until(output, samples + 1, true);
    EXPECT_EQ(byte_stable_content(path(output)), undisturbed) << last << " samples";
  }
}

TEST_F(Stops, SelfMasksAreStoredWithTheRun) {
  std::string rig = testing::content_of(path("rec/rig.yaml"));
  const std::size_t key = rig.find("size_px: [96, 72]");
  ASSERT_NE(key, std::string::npos) << rig;
  const std::size_t line = rig.rfind('\n', key) + 1;
  rig.insert(line, std::string(key - line, ' ') + "self_mask: ../rover.pgm\n");
  std::ofstream(path("rec/rig.yaml")) << rig;
  EXPECT_NE(run("none", {"--max-frames", "2"}).exit_code, 0) << "the mask is missing";
  std::ofstream(path("rover.pgm")) << "P5 96 72 255\n" << std::string(96 * 72, '\xff');
  ASSERT_TRUE(finished(run("out", {"--max-frames", "2"})));
  const Rig stored = read_rig_yaml(path("out/rig.yaml")).value();
  const auto masked = std::find_if(stored.cameras.begin(), stored.cameras.end(),
                                   [](const Camera& camera) { return !camera.self_mask.empty(); });
  ASSERT_NE(masked, stored.cameras.end());
  EXPECT_EQ(masked->self_mask, "masks/" + masked->name + ".pgm");
  EXPECT_EQ(testing::content_of(path("out/" + masked->self_mask)), testing::content_of(path("rover.pgm")));
  const ProgramResult model =
      run_program({"export", path("out"), "--format", "colmap", "-o", path("model"), "--recording", path("rec")});
  EXPECT_EQ(model.exit_code, 0) << model.err;
}

TEST_F(Stops, ArePartOfTheReport) {
  const std::string page = testing::content_of(path("whole/report/index.html"));
  for (const char* part : {"Images", "truth", "localization, 3σ", "inclinometer", "Trajectories on the global map",
                           "Points in each cell of the global map", "Frames by the state of each sensor"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
}

TEST_F(Stops, AreReportedWithTheNumbersOfEvaluate) {
  const auto headline = [&](const std::string& truth, const std::string& align, const std::string& words) {
    const ProgramResult score = run_program({"evaluate", path("whole"), "--truth", truth, "--align", align, "--json"});
    const double error_m = nlohmann::json::parse(score.out)["ate_m"]["rmse"];
    return fmt::format("<b>{:.1f} mm</b>position error, RMS, {}<", 1000 * error_m, words);
  };
  const std::string page = testing::content_of(path("whole/report/index.html"));
  EXPECT_NE(page.find(headline(path("rec"), "first", "first poses aligned")), std::string::npos);
  EXPECT_NE(page.find(headline(path("rec"), "se3", "SE3 alignment")), std::string::npos) << "as in the terminal";
  EXPECT_NE(page.find(">Position error and 3σ, first poses aligned<"), std::string::npos);

  std::ifstream poses(path("rec/truth/poses.tum"));
  std::ofstream places(path("places.tum"));
  for (std::string stamp, x, y, z, rest; poses >> stamp >> x >> y >> z && std::getline(poses, rest);)
    places << stamp << " " << x << " " << y << " " << z << " 0 0 0 1\n";
  places.close();
  ASSERT_TRUE(finished(run("whole", {"--resume", "--truth", path("places.tum")})));
  const std::string fitted = testing::content_of(path("whole/report/index.html"));
  EXPECT_NE(fitted.find(headline(path("places.tum"), "se3", "SE3 alignment")), std::string::npos);
  EXPECT_NE(fitted.find(">Position error, SE3 alignment<"), std::string::npos);
  EXPECT_EQ(fitted.find(", first poses aligned"), std::string::npos);
}

TEST_F(Stops, TheGlobalMapIsDescribedMergedAndExported) {
  const ProgramResult info = run_program({"map", "info", path("whole"), "--json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  const auto printed = nlohmann::json::parse(info.out);
  EXPECT_EQ(printed["stops"].size(), 2u);
  EXPECT_GT(printed["cells"]["free"], 0);
  const auto tif = read_geotiff(path("whole/maps/global.tif"));
  ASSERT_TRUE(tif) << tif.error().message();
  EXPECT_EQ(printed["columns"], tif->bands.front().width());
  EXPECT_EQ(tif->names.size(), 11u) << "as in a local map";

  const ProgramResult same =
      run_program({"map", "merge", path("whole"), path("whole"), "-o", path("same.map"), "--json"});
  ASSERT_EQ(same.exit_code, 0) << same.err;
  EXPECT_NE(same.err.find("2 local maps are in both maps"), std::string::npos) << same.err;
  EXPECT_EQ(nlohmann::json::parse(same.out)["stops"], 2);
  EXPECT_EQ(nlohmann::json::parse(same.out)["shared_stops"], 2);

  // The same ground at another time.
  fs::copy(path("whole"), path("later"), fs::copy_options::recursive);
  auto later = Database::open(path("later/run.sqlite"), Database::Mode::open);
  ASSERT_TRUE(later && later->execute("UPDATE map_stops SET stamp_ns = stamp_ns + 1"));
  const ProgramResult merged =
      run_program({"map", "merge", path("whole"), path("later"), "-o", path("both.map"), "--json"});
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  const auto both = nlohmann::json::parse(merged.out);
  EXPECT_EQ(both["stops"], 4);
  EXPECT_EQ(both["shared_stops"], 0);
  EXPECT_EQ(both["apart_m"]["median"], 0);
  EXPECT_GT(both["both_know_cells"], 0);
  const ProgramResult again = run_program({"map", "info", path("both.map"), "--json"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(nlohmann::json::parse(again.out)["known_m2"], printed["known_m2"]) << "the same ground twice";

  for (const char* file : {"x.tif", "x.png", "x.ply", "x.map"})
    EXPECT_EQ(run_program({"map", "export", path("both.map"), "-o", path(file)}).exit_code, 0) << file;
  EXPECT_EQ(testing::content_of(path("x.map")), testing::content_of(path("both.map")));
  ASSERT_EQ(run_program({"map", "export", path("whole"), "-o", path("part.tif"), "--window", "0,-0.5,1,0.5"}).exit_code,
            0);
  EXPECT_EQ(read_geotiff(path("part.tif"))->bands.front().width(), 100) << "cells of 1 cm";
  ASSERT_EQ(run_program({"export", path("whole"), "--format", "geotiff", "-o", path("run.tif")}).exit_code, 0);
  EXPECT_EQ(testing::content_of(path("run.tif")), testing::content_of(path("whole/maps/global.tif")));

  EXPECT_EQ(run_program({"map", "info", path("nowhere")}).exit_code, 3);
  EXPECT_EQ(run_program({"map", "info", path("x.png")}).exit_code, 3);
  EXPECT_EQ(run_program({"map", "export", path("whole"), "-o", path("x.xyz")}).exit_code, 2);
  EXPECT_EQ(run_program({"map", "export", path("whole"), "-o", path("none.tif"), "--window", "1,0,0,1"}).exit_code, 2);
  EXPECT_EQ(run_program({"map", "export", path("whole"), "-o", path("no/x.tif")}).exit_code, 5);
  EXPECT_EQ(run_program({"map", "merge", path("whole"), path("whole"), "-o", path("no/x.map")}).exit_code, 5);
}

// Moves a tile of the map 1.3 km to the east.
void stretch_map(const std::string& run) {
  auto db = Database::open(run + "/run.sqlite", Database::Mode::open);
  ASSERT_TRUE(db) << db.error().message();
  auto tiles = TileStore::open_existing(*db);
  ASSERT_TRUE(tiles) << tiles.error().message();
  TileEntry entry = tiles->index().value().front();
  const auto tile = tiles->read(entry);
  ASSERT_TRUE(tile) << tile.error().message();
  ASSERT_TRUE(db->execute(fmt::format("DELETE FROM map_tiles WHERE submap = {} AND ix = {} AND iy = {}",
                                      entry.key.submap, entry.key.x, entry.key.y)));
  entry.key.x += 4000;
  ASSERT_TRUE(tiles->write(entry, *tile));
}

TEST_F(Stops, AMapTooLargeForOneImageRemovesTheOldOne) {
  ASSERT_TRUE(fs::exists(path("whole/maps/global.tif")));
  stretch_map(path("whole"));
  const ProgramResult resumed = run("whole", {"--resume"});
  ASSERT_TRUE(finished(resumed)) << resumed.err;
  EXPECT_NE(resumed.err.find("too large for one image"), std::string::npos) << resumed.err;
  EXPECT_EQ(resumed.err.find("no report was written"), std::string::npos) << resumed.err;
  EXPECT_FALSE(fs::exists(path("whole/maps/global.tif")));
  EXPECT_FALSE(fs::exists(path("whole/maps/global.png")));
  const std::string page = testing::content_of(path("whole/report/index.html"));
  EXPECT_NE(page.find("Points in each cell of the global map, summarized in cells of 0.0"), std::string::npos);
}

// A tile with a wrong checksum ends the run when it is read; that step is not committed.
TEST_F(Stops, ADamagedTileEndsTheRun) {
  const std::vector<std::string> at_once{"--set", "stop_delay_frames=0"};
  ASSERT_TRUE(finished(run("undamaged", at_once)));
  ASSERT_TRUE(finished(run("part", {"--max-frames", "3", "--set", "stop_delay_frames=0"})));
  const auto shift_checksums = [&](const std::string& by) {
    auto db = Database::open(path("part/run.sqlite"), Database::Mode::open);
    ASSERT_TRUE(db) << db.error().message();
    ASSERT_TRUE(db->execute("UPDATE map_tiles SET checksum = checksum " + by));
  };
  shift_checksums("+ 1");
  for (int i = 0; i < 2; ++i) {
    const ProgramResult damaged = run("part", {"--resume", "--set", "stop_delay_frames=0"});
    EXPECT_EQ(damaged.exit_code, 3) << damaged.err;
    EXPECT_NE(damaged.err.find("is damaged: checksum mismatch"), std::string::npos) << damaged.err;
    EXPECT_NE(damaged.err.find("run.sqlite"), std::string::npos) << damaged.err;
    EXPECT_EQ(damaged.err.find("skipped"), std::string::npos) << damaged.err;
  }
  shift_checksums("- 1");
  ASSERT_TRUE(finished(run("part", {"--resume", "--set", "stop_delay_frames=0"})));
  EXPECT_EQ(byte_stable_content(path("part")), byte_stable_content(path("undamaged"))) << "no frame was lost";
}

TEST_F(Stops, ADamagedStoreEndsTheRun) {
  ASSERT_TRUE(finished(run("part", {"--max-frames", "3"})));
  std::fstream file(path("part/run.sqlite"), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(0);
  file << std::string(4096, 'x');
  file.close();
  const ProgramResult damaged = run("part", {"--resume"});
  EXPECT_EQ(damaged.exit_code, 3) << damaged.err;
  EXPECT_NE(damaged.err.find("is damaged or not a database"), std::string::npos) << damaged.err;
}

TEST_F(Stops, OdometryOnlyGivesTheSameOdometry) {
  const ProgramResult alone = run("alone", {"--odometry-only", "--json"});
  ASSERT_TRUE(finished(alone)) << alone.err;
  EXPECT_EQ(testing::content_of(path("alone/trajectory_odometry.tum")),
            testing::content_of(path("whole/trajectory_odometry.tum")));
  const auto summary = nlohmann::json::parse(alone.out);
  EXPECT_EQ(summary["world"]["gravity"], "measured") << "the start attitude";
  EXPECT_EQ(summary["world"]["heading"], "east");
  for (const char* stage : {"localization", "mapping", "slam", "maps", "reconstruction", "terrain"})
    EXPECT_FALSE(summary["stages"].contains(stage)) << stage;
  EXPECT_EQ(summary["stages"]["imaging"]["count"], summary["frames"]) << "images of the wide pair are not processed";
  EXPECT_EQ(summary["absent"], nlohmann::json::parse(R"(["localization", "slam", "maps", "terrain"])"));
  EXPECT_TRUE(summary["health"]["localization"].empty());
  EXPECT_TRUE(maps_of("alone").empty());
  for (const char* file :
       {"trajectory_slam.tum", "trajectory_localization.tum", "trajectory_smoothed.tum", "maps/global.tif"})
    EXPECT_FALSE(fs::exists(path("alone/") + file)) << file;
  EXPECT_TRUE(fs::exists(path("alone/report/index.html"))) << alone.err;

  ASSERT_TRUE(finished(run("part", {"--odometry-only", "--max-frames", "3"})));
  EXPECT_EQ(run("part", {"--resume"}).exit_code, 4) << "another run";
  ASSERT_TRUE(finished(run("part", {"--odometry-only", "--resume"})));
  EXPECT_EQ(byte_stable_content(path("part")), byte_stable_content(path("alone")));
  EXPECT_EQ(run("whole", {"--odometry-only", "--resume"}).exit_code, 4);

  const auto exported = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"export", path("alone"), "--format", "tum", "-o", path("x.tum")};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  };
  const ProgramResult refused = exported({"--trajectory", "localization"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.err.find("holds no localization trajectory"), std::string::npos) << refused.err;
  EXPECT_EQ(exported({"--trajectory", "slam"}).exit_code, 3);
  ASSERT_EQ(exported({}).exit_code, 0) << "the best available trajectory";
  EXPECT_EQ(testing::content_of(path("x.tum")), testing::content_of(path("alone/trajectory_odometry.tum")));
  const ProgramResult score = run_program({"evaluate", path("alone"), "--truth", path("rec"), "--json"});
  ASSERT_EQ(score.exit_code, 0) << score.err;
  EXPECT_EQ(nlohmann::json::parse(score.out)["trajectory"], "odometry");
}

TEST_F(Stops, EachTrajectoryIsExported) {
  for (const std::string kind : {"odometry", "slam", "localization", "smoothed"}) {
    ASSERT_EQ(
        run_program({"export", path("whole"), "--format", "tum", "--trajectory", kind, "-o", path(kind)}).exit_code, 0);
    EXPECT_EQ(testing::content_of(path(kind)), testing::content_of(path("whole/trajectory_" + kind + ".tum")));
  }
  EXPECT_NE(testing::content_of(path("odometry")), testing::content_of(path("localization")));
  EXPECT_NE(testing::content_of(path("smoothed")), testing::content_of(path("localization")));
  ASSERT_EQ(run_program({"export", path("whole"), "--format", "tum", "-o", path("best")}).exit_code, 0);
  EXPECT_EQ(testing::content_of(path("best")), testing::content_of(path("localization")));
}

TEST_F(Stops, SpecifiedSensorNoiseIsUsed) {
  ASSERT_TRUE(finished(run("ignored", {"--set", "use_specified_noise=false"})));
  const std::string about = testing::content_of(path("rec/recording.yaml"));
  const auto noise = about.find("imu_noise:");
  ASSERT_NE(noise, std::string::npos);
  EXPECT_NE(about.find("inclinometer_noise:"), std::string::npos);
  std::ofstream(path("rec/recording.yaml")) << about.substr(0, noise);
  ASSERT_TRUE(finished(run("unspecified")));
  const auto localized = [&](const std::string& output) {
    return testing::content_of(path(output + "/trajectory_localization.tum"));
  };
  EXPECT_NE(localized("whole"), localized("ignored"));
  const std::string used = testing::content_of(path("whole/config.yaml"));
  for (const char* line : {"gravity_m_s2: 3.71", "offset_walk_rad_per_sqrt_s: 1e-07", "bias_sigma_rad: 0.00174532"})
    EXPECT_NE(used.find(line), std::string::npos) << line;
  EXPECT_EQ(localized("unspecified"), localized("ignored"));
}

TEST_F(Stops, GivenOptionsAreNotReplacedBySpecifiedNoise) {
  ASSERT_TRUE(finished(run("set", {"--set", "localization.inclinometer.bias_sigma_rad=0.0025"})));
  std::ofstream(path("options.yaml")) << "localization: {compass: {offset_walk_rad_sqrt_hz: 0.00015}}\n";
  ASSERT_TRUE(finished(run("file", {"--config", path("options.yaml")})));
  const auto has = [&](const std::string& output, const char* line) {
    return testing::content_of(path(output + "/config.yaml")).find(line) != std::string::npos;
  };
  EXPECT_TRUE(has("whole", " bias_sigma_rad: 0.00174532") && has("whole", "offset_walk_rad_per_sqrt_s: 1e-07"));
  EXPECT_TRUE(has("set", " bias_sigma_rad: 0.0025 ")) << "given with --set";
  EXPECT_TRUE(has("set", "offset_walk_rad_per_sqrt_s: 1e-07")) << "not given: as the recording specifies";
  EXPECT_TRUE(has("file", "offset_walk_rad_per_sqrt_s: 0.00015 ")) << "given in the file, under its former name";
  EXPECT_TRUE(has("file", " bias_sigma_rad: 0.00174532"));
}

// The narrow frame of the first stop is the last commit.
TEST_F(Stops, AreMappedAfterAnInterruptionDuringTheStop) {
  ASSERT_TRUE(finished(run("part", {"--max-frames", "1"})));
  EXPECT_TRUE(maps_of("part").empty());
  ASSERT_TRUE(finished(run("part", {"--resume"})));
  EXPECT_EQ(byte_stable_content(path("part")), byte_stable_content(path("whole")));
}

TEST_F(Stops, AreMappedTheSameAfterKills) {
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE(finished(run("again")));
  const auto took = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - start);
  const auto whole = byte_stable_content(path("whole"));
  for (const double share : {0.2, 0.4, 0.6, 0.8}) {
    const std::string out = "killed_" + std::to_string(share);
    ProgramLimits limits;
    limits.kill_after = std::chrono::milliseconds(static_cast<int>(share * static_cast<double>(took.count())));
    run(out, {}, limits);
    ASSERT_TRUE(finished(run(out, {"--resume"})));
    EXPECT_EQ(byte_stable_content(path(out)), whole) << "killed after " << share << " of the run";
  }
}

TEST_F(Stops, GiveTheSameBytesForAnyNumberOfThreads) {
  ASSERT_TRUE(finished(run("one", {"--threads", "1"})));
  EXPECT_EQ(byte_stable_content(path("one")), byte_stable_content(path("whole")));
}

TEST_F(Stops, OptionDisablesMaps) {
  ASSERT_TRUE(finished(run("out", {"--set", "maps=false"})));
  EXPECT_TRUE(maps_of("out").empty());
}

}  // namespace
}  // namespace spartan
