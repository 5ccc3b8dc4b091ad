// The index files of recordings: frames.csv and recording.yaml, KITTI's times.txt, lists of times, EuRoC's data.csv.
#include <cstdint>
#include <filesystem>
#include <string>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/recording.h"
#include "spartan/image_io/image_io.h"
#include "spartan/testing/temporary_folder.h"

namespace {

using spartan::testing::TemporaryFolder;

constexpr const char* kCalib = "P0: 30 0 16 0 0 30 8 0 0 0 1 0\nP1: 30 0 16 -3 0 30 8 0 0 0 1 0\n";
constexpr const char* kFrames =
    "frame_id,position_id,pair,left_stamp_ns,right_stamp_ns,left,right,pan_deg,tilt_deg,exposure_us,gain,bits\n"
    "0,0,stereo,1,1,image_0/000000.png,image_1/000000.png,0,0,0,0,8\n";

// A folder with the files of every layout and one valid image for each camera.
struct Recording {
  Recording() {
    folder.write("calib.txt", kCalib);
    folder.write("rig.yaml",
                 spartan::to_rig_yaml(spartan::read_kitti_calib(folder.path() + "/calib.txt", {32, 16}).value()));
    const spartan::Image<std::uint8_t> image(32, 16);
    for (const char* name : {"image_0/000000.png", "image_1/000000.png", "cam0/data/1.png", "cam1/data/1.png"}) {
      if (!spartan::write_png(folder.file(name), image.view())) __builtin_trap();
    }
  }
  void open(spartan::RecordingFormat format, const std::string& times = "") const {
    spartan::OpenOptions options;
    options.times_file = times;
    options.format = format;
    options.rig_file = folder.path() + "/rig.yaml";
    const auto source = spartan::open_recording(folder.path(), options);
    for (int i = 0; source && i < 20; ++i) {
      const auto sample = (*source)->next();
      if (!sample || !*sample) break;
    }
  }
  TemporaryFolder folder;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Recording recording;
  const std::string text(reinterpret_cast<const char*>(data), size);
  recording.folder.write("recording.yaml", "schema: 1\n");
  recording.folder.write("frames.csv", text);
  recording.open(spartan::RecordingFormat::spartan);
  recording.folder.write("recording.yaml", text);
  recording.folder.write("frames.csv", kFrames);
  recording.open(spartan::RecordingFormat::spartan);
  recording.folder.write("times.txt", text);
  recording.open(spartan::RecordingFormat::kitti);
  recording.open(spartan::RecordingFormat::kitti, recording.folder.path() + "/times.txt");
  for (const char* camera : {"cam0", "cam1"}) recording.folder.write(std::string(camera) + "/data.csv", text);
  recording.open(spartan::RecordingFormat::euroc);
  return 0;
}
