// `spartan run` over a live stream: pace, messages, clean end, watchdog.
#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "run_on_small_drive.h"
#include "spartan/core/files.h"
#include "spartan/core/image.h"
#include "spartan/image_io/image_io.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using testing::ProgramLimits;
using testing::ProgramResult;
using testing::run_in_shell;
using testing::run_program;
using testing::summary_of;

class RunLive : public testing::RunOnSmallDrive {
 protected:
  // 14 frames in 6.5 s of stamps.
  std::vector<std::string> words(const std::string& output, const std::vector<std::string>& more) const {
    std::vector<std::string> all{"run", "replay:" + drive(), "-o", path(output)};
    all.insert(all.end(), testing::kSmallDriveOptions.begin(), testing::kSmallDriveOptions.end());
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  ProgramResult run_live(const std::string& output, const std::vector<std::string>& more,
                         const ProgramLimits& limits = {}) const {
    return run_program(words(output, more), limits);
  }

  // Complete rows of frames.csv.
  static int recorded_frames(const std::string& recording) {
    const std::string table = read_file(recording + "/frames.csv").value_or("");
    return std::max(0, static_cast<int>(std::count(table.begin(), table.end(), '\n')) - 1);
  }

  // Killed as soon as the recording that it makes lists some frames, and `file` is there.
  static ProgramResult killed_with_frames(const std::string& recording, const std::string& file,
                                          const std::vector<std::string>& words) {
    std::vector<std::string> all{recording, file};
    all.insert(all.end(), words.begin(), words.end());
    return run_in_shell(R"sh(recording=$1 file=$2; shift 2
"$0" "$@" & pid=$!
for i in $(seq 600); do
  sleep 0.05
  [ -e "$file" ] && [ "$(wc -l < "$recording/frames.csv")" -gt 3 ] && break
done
kill -KILL $pid; wait $pid)sh",
                        all);
  }

  // The script starts the program in the background and reads its messages. Dash has no /dev/tcp.
  ProgramResult run_with_reader(const std::string& target, const std::string& script) const {
    const std::string file = path("reader.sh");
    std::ofstream(file) << "program=$1 target=$2 messages=$3\nshift 3\n" << script << "\nwait %1\n";
    std::vector<std::string> all{file, target, path("messages")};
    for (const std::string& word : words("live", {"--speed", "4", "-q"})) all.push_back(word);
    return run_in_shell(R"(script=$1; shift; exec bash "$script" "$0" "$@")", all);
  }

  // The messages of each type. Each line must be one JSON object.
  static std::map<std::string, std::vector<nlohmann::json>> messages_in(const std::string& text) {
    std::map<std::string, std::vector<nlohmann::json>> messages;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      const auto json = nlohmann::json::parse(line);
      EXPECT_EQ(json["schema"], 1);
      messages[json["type"]].push_back(json);
    }
    return messages;
  }
};

TEST_F(RunLive, ReplayGivesTheOdometryOfTheRecording) {
  copy_finished_run("recorded");
  const auto begin = std::chrono::steady_clock::now();
  const ProgramResult result = run_live("live", {"--speed", "5", "--json"});
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_GT(seconds, 6.5 / 5) << "the pace of the stamps";
  EXPECT_EQ(read_file(path("live/trajectory_odometry.tum")).value(),
            read_file(path("recorded/trajectory_odometry.tum")).value());
  const auto summary = summary_of(path("live"));
  EXPECT_EQ(summary["format"], "live");
  EXPECT_EQ(summary["input"], "replay:" + drive());
  EXPECT_EQ(summary["live"]["latency_ms"]["count"], 14);
  EXPECT_EQ(summary["live"]["dropped"]["odometry"], 0);
  EXPECT_FALSE(summary["stages"].contains("camera")) << "waiting is no stage";
}

TEST_F(RunLive, SeveralPassesGoOn) {
  const ProgramResult result = run_live("live", {"--speed", "20", "--passes", "2", "--json"});
  ASSERT_TRUE(result.exit_code == 0 || result.exit_code == 6) << result.err;
  EXPECT_EQ(summary_of(path("live"))["live"]["latency_ms"]["count"], 28);
}

TEST_F(RunLive, PublishesPosesHealthAndMaps) {
  const ProgramResult result = run_live("live", {"--speed", "10", "--publish", "-"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto messages = messages_in(result.out);
  ASSERT_EQ(messages.at("pose").size(), 14U) << "one for each frame: there is no IMU";
  ASSERT_EQ(messages.at("health").size(), 14U);
  EXPECT_EQ(messages.at("health").back()["odometry"], "tracking");
  EXPECT_GT(messages.at("health").back()["latency_ms"].get<double>(), 0);
  EXPECT_EQ(messages.at("health").back()["sensors"]["vision"]["state"], "ok");
  const auto& pose = messages.at("pose").back();
  EXPECT_EQ(pose["stamp_ns"], 6'500'000'000);
  EXPECT_NEAR(pose["world_from_body"]["position_m"][0], 0.52, 0.03);
  EXPECT_GT(pose["world_from_body"]["sigma_m"][0], 0);
  ASSERT_FALSE(messages.at("map").empty());
  EXPECT_TRUE(read_file(path("live/" + messages.at("map").front()["file"].get<std::string>())));
}

TEST_F(RunLive, PublishesToAFifoWhoseReaderComesLater) {
  const ProgramResult result = run_with_reader(
      path("fifo"),
      R"(mkfifo "$target"; "$program" "$@" --publish "$target" & sleep 0.3; timeout 60 cat "$target" > "$messages")");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto messages = messages_in(read_file(path("messages")).value());
  EXPECT_GT(messages.at("pose").size(), 5U);
}

TEST_F(RunLive, PublishesToTcpClientsOfThisComputer) {
  const std::string port = std::to_string(20000 + ::getpid() % 20000);
  const ProgramResult result = run_with_reader(port,
                                               R"("$program" "$@" --publish "tcp:$target" &
for i in $(seq 100); do sleep 0.05; if exec 3<> "/dev/tcp/127.0.0.1/$target"; then break; fi; done 2> /dev/null
timeout 60 cat <&3 > "$messages")");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_GT(messages_in(read_file(path("messages")).value()).at("health").size(), 5U);
}

// A line that is no command changes nothing.
TEST_F(RunLive, ALineInTheControlFifoEndsIt) {
  const auto begin = std::chrono::steady_clock::now();
  const ProgramResult result = run_with_reader(path("control"),
                                               R"("$program" "$@" --passes 40 --control "$target" &
for i in $(seq 200); do sleep 0.05; [ -p "$target" ] && break; done
sleep 0.5; printf 'not a command\nstop\n' > "$target")");
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_LT(seconds, 30) << "of 65";
  EXPECT_TRUE(read_file(path("live/summary.json")));
  const ProgramResult no_fifo = run_live("other", {"--control", path("live/summary.json")});
  EXPECT_EQ(no_fifo.exit_code, 5);
  EXPECT_THAT(no_fifo.err, HasSubstr("is no FIFO"));
}

// A second writer ends the run while the first one writes for ever.
TEST_F(RunLive, AControlFifoThatIsNeverEmptyDelaysNothing) {
  const auto begin = std::chrono::steady_clock::now();
  const ProgramResult result =
      run_with_reader(path("control"), R"sh("$program" "${@/#-q/--json}" --passes 40 --control "$target" &
for i in $(seq 200); do sleep 0.05; [ -p "$target" ] && break; done
{ head -c 5000 /dev/zero; echo; } > "$target"
timeout 40 yes "$(printf 'y\033[2J%0100d' 0)" > "$target" &
sleep 1; printf '\nstop\n' > "$target")sh");
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_LT(seconds, 25) << "of 40";
  EXPECT_LT(result.err.size(), 2000u) << "one line of each kind, and their number: " << result.err;
  EXPECT_THAT(result.err, HasSubstr("'y?[2J000"));
  EXPECT_THAT(result.err, HasSubstr("is no command of a run"));
  EXPECT_THAT(result.err, HasSubstr("lines of the control FIFO were no commands"));
  EXPECT_THAT(result.err, HasSubstr("longer than 1000 characters"));
}

TEST_F(RunLive, ItsOptionsAreRejectedForARecording) {
  const std::string fifo = path("fifo");
  const std::vector<std::vector<std::string>> all{{"--speed", "2"},          {"--passes", "2"},
                                                  {"--sensors", fifo},       {"--set-scenario", "rover=ordinary"},
                                                  {"--control", fifo},       {"--pan-tilt", "flir:/dev/null"},
                                                  {"--panorama-every", "2"}, {"--watchdog", "0"},
                                                  {"--no-recording"},        {"--record-images", "png"}};
  for (const std::vector<std::string>& option : all) {
    const ProgramResult result = run("other", option);
    EXPECT_EQ(result.exit_code, 2) << option[0];
    EXPECT_THAT(result.err, HasSubstr(option[0]));
    EXPECT_THAT(result.err, HasSubstr("replay:" + drive())) << "what to do";
  }
  EXPECT_FALSE(std::filesystem::exists(fifo)) << "nothing is made";
  EXPECT_FALSE(std::filesystem::exists(path("other")));
}

TEST_F(RunLive, WhatHasNoEffectOnAStreamIsRejected) {
  const auto rejected = [&](const std::string& input, const std::vector<std::string>& option) {
    for (const std::string command : {"run", "record"}) {
      std::vector<std::string> words{command, input, "-o", path("other")};
      words.insert(words.end(), option.begin(), option.end());
      const ProgramResult result = run_program(words);
      EXPECT_EQ(result.exit_code, 2) << command << ' ' << input << ' ' << option[0] << result.err;
      EXPECT_THAT(result.err, HasSubstr("omit ")) << input << ' ' << option[0];
      EXPECT_THAT(result.err, HasSubstr(option[0])) << input;
    }
  };
  const std::string rig = drive() + "/calib.txt";
  rejected("live:rig.yaml", {"--rig", rig});
  rejected("sim:quick", {"--rig", rig});
  rejected("sim:quick", {"--passes", "2"});
  rejected("sim:quick", {"--sensors", path("fifo")});
  rejected("gst:videotestsrc", {"--speed", "2"});
  rejected("aravis:a,b", {"--set-scenario", "rover=ordinary"});
  rejected("gst:videotestsrc", {"--fps", "2"});
  rejected("replay:" + drive(), {"--set-scenario", "rover=ordinary"});
  EXPECT_FALSE(std::filesystem::exists(path("fifo")));
}

TEST_F(RunLive, ARecordingNamesTheSensorRowsThatWereDiscarded) {
  const std::string stops = testing::small_runs_folder() + "/stops/rec";
  if (!std::filesystem::exists(stops)) GTEST_SKIP() << "built without Embree";
  std::filesystem::copy(stops, path("rec"), std::filesystem::copy_options::recursive);
  std::ofstream(path("rec/sensors/wheels.csv"), std::ios::app) << "nothing,1,2\n";
  const ProgramResult result =
      run_program({"record", "replay:" + path("rec"), "-o", path("copy"), "--speed", "1000", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("1 rows of sensor tables discarded"));
  EXPECT_THAT(result.err, HasSubstr("'nothing' is not a time in nanoseconds"));
  EXPECT_EQ(nlohmann::json::parse(result.out)["skipped_sensor_rows"]["unreadable"], 1);
}

TEST_F(RunLive, TellsAServiceManagerThatItIsReady) {
  const int server = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = path("notify");
  ASSERT_LT(name.size(), sizeof(address.sun_path));
  std::copy(name.begin(), name.end(), address.sun_path);
  ASSERT_EQ(::bind(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  const timeval wait{0, 50000};
  ASSERT_EQ(::setsockopt(server, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof(wait)), 0);
  std::vector<std::string> messages;
  std::atomic<bool> ended = false;
  std::thread manager([&] {  // reads meanwhile: a socket holds ten datagrams, and the program does not wait
    for (std::array<char, 512> bytes{};;) {
      const ssize_t n = ::recv(server, bytes.data(), bytes.size(), 0);
      if (n > 0) {
        messages.emplace_back(bytes.data(), static_cast<std::size_t>(n));
      } else if (ended) {
        break;
      }
    }
  });
  std::vector<std::string> all{name};
  for (const std::string& word : words("live", {"--speed", "4", "-q"})) all.push_back(word);
  const ProgramResult result = run_in_shell(R"(NOTIFY_SOCKET=$1; export NOTIFY_SOCKET; shift; exec "$0" "$@")", all);
  ended = true;
  manager.join();
  ::close(server);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  ASSERT_GE(messages.size(), 3U);
  EXPECT_EQ(messages.front(), "WATCHDOG=1") << "also before the first frame";
  EXPECT_THAT(messages, ::testing::Contains(::testing::StartsWith("READY=1\nSTATUS=frame 0, odometry")).Times(1));
  EXPECT_THAT(messages, ::testing::Contains(::testing::StartsWith("WATCHDOG=1\nSTATUS=frame ")));
  EXPECT_EQ(messages.back(), "STOPPING=1\n");
}

// As over a network that was cut off.
TEST_F(RunLive, NeitherARunNorARecordingWaitsForAReaderOfItsStandardError) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  const std::string full(1U << 20U, 'x');
  ASSERT_EQ(::fcntl(ends[1], F_SETFL, O_NONBLOCK), 0);
  while (::write(ends[1], full.data(), full.size()) > 0) continue;
  while (::write(ends[1], full.data(), 1) > 0) continue;
  ASSERT_EQ(::fcntl(ends[1], F_SETFL, 0), 0);
  const std::string to = fmt::format("/proc/{}/fd/{}", ::getpid(), ends[1]);
  const std::vector<std::string> record{"record", "replay:" + drive(), "-o", path("recorded"), "--speed", "20"};
  for (std::vector<std::string> arguments : {words("live", {"--speed", "20"}), record}) {
    arguments.insert(arguments.begin(), to);
    const ProgramResult result = run_in_shell(R"(to=$1; shift; exec timeout -s KILL 60 "$0" "$@" 2>"$to")", arguments);
    EXPECT_EQ(result.exit_code, 0) << arguments[1];
  }
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST_F(RunLive, RejectsWhatCannotBePublishedTo) {
  for (const std::string target : {"/nowhere/fifo", "tcp:", "tcp:99999", "tcp:here:80"}) {
    const ProgramResult result = run_live("live", {"--publish", target});
    EXPECT_EQ(result.exit_code, 2) << target;
    EXPECT_THAT(result.err, HasSubstr("tcp:PORT")) << target;
  }
  EXPECT_EQ(run_live("live", {"--publish", "-", "--json"}).exit_code, 2);
  EXPECT_EQ(run_program({"run", "replay:" + path("nowhere"), "-o", path("live")}).exit_code, 3);
}

TEST_F(RunLive, ASignalEndsItCleanly) {
  const auto begin = std::chrono::steady_clock::now();
  ProgramLimits limits;
  limits.interrupt_once_there = path("live/run.sqlite");
  const ProgramResult result = run_live("live", {"--speed", "0.5", "--json"}, limits);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ASSERT_EQ(result.exit_code, 0) << "the end of a live run; " << result.err;
  EXPECT_LT(seconds, 6) << "of 13";
  EXPECT_FALSE(read_file(path("live/run.sqlite-wal"))) << "the store is closed";
  EXPECT_TRUE(read_file(path("live/trajectory_odometry.tum")));
}

// The stream goes on after the last recorded sample. The odometry is that of the recording, bit for bit.
TEST_F(RunLive, KilledAtAnyMomentItGoesOn) {
  copy_finished_run("recorded");
  const std::string expected = read_file(path("recorded/trajectory_odometry.tum")).value();
  for (const auto& [after_ms, state_every_s] :
       {std::pair(150, "30"), {600, "30"}, {1300, "0.2"}, {1900, "30"}, {2400, "0.2"}, {3100, "0.5"}}) {
    SCOPED_TRACE(after_ms);
    const std::string output = "killed_" + std::to_string(after_ms), state = "commit.state_every_s=";
    ProgramLimits limits;
    limits.kill_after = std::chrono::milliseconds(after_ms);
    run_live(output, {"--speed", "2", "--set", state + state_every_s}, limits);
    // The stream does not bring what was recorded again.
    for (int i = 0; i < std::min(recorded_frames(path(output + "/live/1")), 13); ++i) remove_pair(i);
    const ProgramResult resumed = run_live(output, {"--speed", "10", "--set", state + state_every_s, "--resume"});
    ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
    EXPECT_EQ(read_file(path(output + "/trajectory_odometry.tum")).value(), expected);
    copy_drive();
  }
}

TEST_F(RunLive, ARecordingThatWasKilledCanBeProcessed) {
  const std::string recording = path("recording");
  const ProgramResult killed = killed_with_frames(
      recording, recording + "/frames.csv", {"record", "replay:" + drive(), "-o", recording, "--speed", "2", "-q"});
  ASSERT_EQ(killed.exit_code, 128 + SIGKILL) << killed.err;
  ASSERT_FALSE(std::filesystem::exists(recording + "/recording.yaml"));
  const int frames = recorded_frames(recording);
  ASSERT_GE(frames, 3);
  std::ofstream(recording + "/frames.csv", std::ios::app) << "14,-1,ste";
  const ProgramResult processed = run_program({"run", recording, "-o", path("run"), "--threads", "2"});
  ASSERT_THAT(processed.exit_code, ::testing::AnyOf(0, 6)) << processed.err;
  EXPECT_THAT(processed.err, HasSubstr("the recording is not finished"));
  EXPECT_EQ(summary_of(path("run"))["frames"], frames);
}

TEST_F(RunLive, ResumedTwiceItHasAllRecordings) {
  ProgramLimits limits;
  limits.kill_after = std::chrono::milliseconds(1600);
  run_live("live", {"--speed", "1.5"}, limits);
  std::filesystem::create_directories(path("live/live/2"));  // killed before its recording had a file
  run_live("live", {"--speed", "1.5", "--resume"}, limits);
  const ProgramResult resumed = run_live("live", {"--speed", "10", "--resume"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(summary_of(path("live"))["frames"], 14);
  EXPECT_TRUE(read_file(path("live/live/4/recording.yaml")));
}

// Where the rover is now its cameras see something else than at the start, which must not choose the rig again.
TEST_F(RunLive, ResumedItKeepsTheRigThatItsFirstImagesHaveAligned) {
  const ProgramResult killed =
      killed_with_frames(path("live/live/1"), path("live/rig.yaml"),
                         words("live", {"--speed", "2", "-q", "--set", "commit.state_every_s=0.2"}));
  ASSERT_EQ(killed.exit_code, 128 + SIGKILL) << killed.err;
  const std::string rig = read_file(path("live/rig.yaml")).value();
  constexpr int kShifted = 2;  // rows
  for (int i = 0; i < 14; ++i) {
    const FrameImage right = read_image(image(1, i)).value();
    Image<std::uint8_t> moved(right.width(), right.height());
    for (int y = 0; y < moved.height(); ++y) {
      const std::uint8_t* const from = right.as<std::uint8_t>().row(std::min(y + kShifted, moved.height() - 1));
      std::copy_n(from, moved.width(), moved.row(y));
    }
    ASSERT_TRUE(write_png(image(1, i), moved));
  }
  const ProgramResult other = run_live("other", {"--speed", "50"});
  ASSERT_NE(read_file(path("other/rig.yaml")).value(), rig) << "these images choose another rig";
  const ProgramResult resumed = run_live("live", {"--speed", "10", "--set", "commit.state_every_s=0.2", "--resume"});
  EXPECT_THAT(resumed.exit_code, ::testing::AnyOf(0, 6)) << resumed.err;  // rows of the moved images do not fit
  EXPECT_EQ(read_file(path("live/rig.yaml")).value(), rig);
  EXPECT_EQ(summary_of(path("live"))["frames"], 14);
}

TEST_F(RunLive, ResumedWithOtherOptionsItNamesThem) {
  ASSERT_EQ(run_live("live", {"--speed", "20", "--max-frames", "5"}).exit_code, 0);
  const ProgramResult resumed =
      run_live("live", {"--speed", "20", "--set", "odometry.detection.landmarks=300", "--resume"});
  EXPECT_EQ(resumed.exit_code, 4);
  EXPECT_THAT(resumed.err, HasSubstr("odometry.detection.landmarks"));
  // Given, the default is not what the first images chose.
  const ProgramResult given = run_live("live", {"--speed", "20", "--set", "mapping.map.cell_m=0.05", "--resume"});
  EXPECT_EQ(given.exit_code, 4);
  EXPECT_THAT(given.err, HasSubstr("now 'mapping.map.cell_m terrain.every_m'"));
}

TEST_F(RunLive, TheWatchdogNamesTheStageThatHangs) {
  const ProgramResult result = run_live("live", {"--speed", "10", "--watchdog", "0.0001"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("has not ended"));
  EXPECT_THAT(result.err, HasSubstr("stage '"));
}

}  // namespace
}  // namespace spartan
