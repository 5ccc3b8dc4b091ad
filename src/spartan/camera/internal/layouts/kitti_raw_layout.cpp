// KITTI raw layout (synchronised and rectified): image_00/data and image_01/data with timestamps.txt, oxts/,
// calibration in the folder of the drive or in the folder of the day above it. Source: Geiger et al., "Vision meets
// robotics: the KITTI dataset", IJRR 2013; the development kit's readme.
#include <fmt/format.h>

#include <filesystem>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/internal/frame_tables.h"
#include "spartan/camera/internal/layouts/image_folder.h"
#include "spartan/camera/internal/recording_index.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

Result<std::vector<Stamp>> read_stamps(const std::string& path) {
  auto table = TableReader::open(path, kitti_raw_times_format());
  if (!table) return failure(table);
  return read_kitti_raw_times(std::move(*table));
}

// OXTS files hold one sample each: 30 numbers, of which (counted from 0) 11 … 13 are the acceleration and 17 … 19 the
// angular rate along x, y, z of the unit.
class OxtsStream : public SensorStream {
 public:
  OxtsStream(fs::path folder, std::vector<Stamp> stamps) : folder_(std::move(folder)), stamps_(std::move(stamps)) {}

  Result<std::optional<Sample>> next() override {
    while (next_ < stamps_.size()) {
      const std::size_t i = next_++;
      const fs::path file = folder_ / fmt::format("{:010}.txt", i);
      std::error_code error;
      if (!fs::exists(file, error)) continue;  // some drives lack single files
      auto table = TableReader::open(file.string(), kitti_raw_times_format());
      if (!table) return failure(table);
      const auto row = table->next(20);
      if (!row) return failure(row);
      if (!*row) return table->error_in_row("the file holds no sample");
      std::array<double, 6> v{};
      for (std::size_t k = 0; k < 6; ++k) {
        const auto value = parse_number<double>((**row)[k < 3 ? 11 + k : 14 + k]);
        if (!value) return table->error_in_row("holds a value that is not a finite number");
        v[k] = *value;
      }
      return Sample(ImuSample{stamps_[i], {v[3], v[4], v[5]}, {v[0], v[1], v[2]}});
    }
    return std::nullopt;
  }

 private:
  fs::path folder_;
  std::vector<Stamp> stamps_;
  std::size_t next_ = 0;
};

std::string find_calibration(const fs::path& drive) {
  std::error_code error;
  for (const fs::path& folder : {drive, fs::weakly_canonical(drive, error).parent_path()}) {
    if (fs::exists(folder / "calib_cam_to_cam.txt", error)) return (folder / "calib_cam_to_cam.txt").string();
  }
  return (drive / "calib_cam_to_cam.txt").string();
}

}  // namespace

Result<RecordingIndex> index_kitti_raw(const LayoutChoice& layout, const OpenOptions& options) {
  const fs::path folder = layout.folder;
  RecordingIndex index;
  std::error_code error;
  const bool gray = fs::exists(folder / "image_00", error) || !fs::exists(folder / "image_02", error);
  const fs::path left_folder = folder / (gray ? "image_00" : "image_02"),
                 right_folder = folder / (gray ? "image_01" : "image_03");
  const auto left = read_stamps((left_folder / "timestamps.txt").string());
  if (!left) return failure(left);
  const auto right = read_stamps((right_folder / "timestamps.txt").string());
  if (!right) return failure(right);
  const std::string left_images = (left_folder / "data").string();
  auto numbered = number_images(left_images, (right_folder / "data").string(), left->size());
  if (!numbered) return failure(numbered);
  NumberedImages& images = *numbered;
  index.info.sequence.remarks = std::move(images.remarks);
  const auto listed = list_images(left_images);
  if (!listed) return failure(listed);
  const auto size = common_image_size(*listed);
  if (!size) return failure(ErrorCode::input, "holds no readable image", left_images);
  const std::string calib = find_calibration(folder);
  const KittiPair cameras = gray ? KittiPair::gray : KittiPair::colour;
  auto rig = choose_rig(options, calib, *size, [&] { return read_kitti_raw_calib(calib, cameras); });
  if (!rig) return failure(rig);
  index.info.rig = std::move(rig->rig);
  index.info.rig_source = rig->source;

  for (std::size_t i = 0; i < left->size(); ++i) {
    FrameEntry entry;
    entry.frame_id = static_cast<std::int64_t>(i);
    entry.pair = default_pair(index.info.rig);
    entry.left_stamp = (*left)[i];
    entry.right_stamp = i < right->size() ? (*right)[i] : entry.left_stamp;
    entry.left_file = images.frames[i].left;
    entry.right_file = images.frames[i].right;
    if (entry.left_file.empty() || entry.right_file.empty()) {
      entry.fault = entry.left_file.empty() ? FrameFault::left_missing : FrameFault::right_missing;
      entry.message = fmt::format("{}: has no image number {}", folder.string(), i);
    }
    index.frames.push_back(std::move(entry));
  }
  // Without the IMU-to-camera calibration the body frame is the left camera and the orientation of the IMU is unknown.
  const bool body_is_imu = index.info.rig.convention == PoseConvention::body;
  if (const fs::path oxts = folder / "oxts"; body_is_imu && fs::exists(oxts / "timestamps.txt", error)) {
    index.sensor_files.push_back((oxts / "timestamps.txt").string());
    index.imu = [oxts]() -> Result<std::unique_ptr<SensorStream>> {
      auto stamps = read_stamps((oxts / "timestamps.txt").string());
      if (!stamps) return failure(stamps);
      return std::make_unique<OxtsStream>(oxts / "data", std::move(*stamps));
    };
  }
  return index;
}

}  // namespace spartan::internal
