#include "spartan/camera/recording_writer.h"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>

#include "spartan/camera/spartan_format.h"
#include "spartan/camera/table.h"
#include "spartan/core/files.h"
#include "spartan/core/image_io.h"
#include "spartan/core/options.h"
#include "spartan/rig/rig_files.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

// A text table that grows row by row.
class TableFile {
 public:
  static Result<TableFile> create(const std::string& path, const std::string& header) {
    TableFile table;
    table.path_ = path;
    table.file_.reset(std::fopen(path.c_str(), "wb"));
    if (!table.file_)
      return failure(ErrorCode::output, std::string("cannot be written: ") + std::strerror(errno), path);
    if (Status s = table.append(header); !s) return failure(s);
    return table;
  }
  Status append(const std::string& row) {
    const std::string line = row + "\n";
    if (std::fwrite(line.data(), 1, line.size(), file_.get()) != line.size()) return fault();
    return {};
  }
  Status flush() { return std::fflush(file_.get()) == 0 ? Status{} : fault(); }

 private:
  Status fault() const {
    return failure(ErrorCode::output, std::string("cannot be written: ") + std::strerror(errno), path_,
                   "free space on the disk");
  }
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
};

Status write_image(const std::string& path, const FrameImage& image) {
  const PixelFormat& format = image.format();
  if (format.layout == PixelLayout::rgb) {
    if (format.bits == 8) return write_png(path, image.as<Rgb8>());
    return failure(ErrorCode::output, "colour of more than 8 bits cannot be recorded; record the Bayer image", path);
  }
  return format.bits > 8 ? write_png(path, image.as<std::uint16_t>()) : write_png(path, image.as<std::uint8_t>());
}

}  // namespace

struct RecordingWriter::State {
  std::string folder;
  RecordingOptions options;
  Rig rig;
  std::optional<TableFile> frames;
  std::map<std::string, TableFile> sensors;

  Status append_sensor(const std::string& name, const char* header, const std::string& row) {
    auto found = sensors.find(name);
    if (found == sensors.end()) {
      if (Status s = make_folder(folder + "/sensors"); !s) return s;
      auto table = TableFile::create(folder + "/sensors/" + name, header);
      if (!table) return failure(table);
      found = sensors.emplace(name, std::move(*table)).first;
    }
    return found->second.append(row);
  }
};

RecordingWriter::RecordingWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;
RecordingWriter::~RecordingWriter() = default;

Result<RecordingWriter> RecordingWriter::create(const std::string& folder, const Rig& believed_rig,
                                                const RecordingOptions& options) {
  if (Status s = believed_rig.validate("rig of the recording"); !s) return failure(s);
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_empty(folder, error)) {
    return failure(ErrorCode::output, "exists already and is left as it is", folder, "give another folder");
  }
  if (Status s = make_folder(folder); !s) return failure(s);
  for (const StereoPair& pair : believed_rig.pairs) {
    if (Status s = make_folder(folder + "/images/" + pair.name); !s) return failure(s);
  }
  if (Status s = write_file_atomically(folder + "/rig.yaml", to_rig_yaml(believed_rig)); !s) return failure(s);
  auto frames = TableFile::create(folder + "/frames.csv", kFramesHeader);
  if (!frames) return failure(frames);
  auto state = std::make_unique<State>();
  state->folder = folder;
  state->options = options;
  state->rig = believed_rig;
  state->frames.emplace(std::move(*frames));
  return RecordingWriter(std::move(state));
}

Status RecordingWriter::add(const StereoFrame& frame) {
  if (!state_->rig.find_pair(frame.pair))
    return failure(ErrorCode::output, "the rig has no pair '" + frame.pair + "'", state_->folder);
  const std::string stem = fmt::format("images/{}/{}", frame.pair, frame.left_stamp.ns);
  const std::string left = stem + "_left.png", right = stem + "_right.png";
  if (Status s = write_image(state_->folder + "/" + left, frame.left); !s) return s;
  if (Status s = write_image(state_->folder + "/" + right, frame.right); !s) return s;
  return state_->frames->append(fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}", frame.frame_id, frame.position_id,
                                            frame.pair, frame.left_stamp.ns, frame.right_stamp.ns, left, right,
                                            to_degrees(frame.pan_rad), to_degrees(frame.tilt_rad), frame.exposure_us,
                                            frame.gain, frame.left.format().bits));
}

Status RecordingWriter::add(const ImuSample& s) {
  return state_->append_sensor("imu.csv", kImuHeader,
                               fmt::format("{},{},{},{},{},{},{}", s.stamp.ns, s.gyro_rad_s.x(), s.gyro_rad_s.y(),
                                           s.gyro_rad_s.z(), s.accel_m_s2.x(), s.accel_m_s2.y(), s.accel_m_s2.z()));
}
Status RecordingWriter::add(const WheelSample& s) {
  return state_->append_sensor("wheels.csv", kWheelsHeader, fmt::format("{},{},{}", s.stamp.ns, s.left_m, s.right_m));
}
Status RecordingWriter::add(const CompassSample& s) {
  return state_->append_sensor("compass.csv", kCompassHeader,
                               fmt::format("{},{},{}", s.stamp.ns, s.heading_rad, s.sigma_rad));
}
Status RecordingWriter::add(const InclinometerSample& s) {
  return state_->append_sensor("inclinometer.csv", kInclinometerHeader,
                               fmt::format("{},{},{},{}", s.stamp.ns, s.roll_rad, s.pitch_rad, s.sigma_rad));
}

Status RecordingWriter::write_truth(const Rig& true_rig, const Trajectory& poses) {
  if (Status s = make_folder(state_->folder + "/truth"); !s) return s;
  if (Status s = write_file_atomically(state_->folder + "/truth/rig.yaml", to_rig_yaml(true_rig)); !s) return s;
  return write_file_atomically(state_->folder + "/truth/poses.tum", to_tum(poses));
}

Status RecordingWriter::write_truth_disparity(const std::string& pair, Stamp left_stamp,
                                              ImageView<const float> disparity, ImageView<const std::uint8_t> mask) {
  const std::string truth = state_->folder + "/truth", name = fmt::format("/{}/{}.png", pair, left_stamp.ns);
  if (Status s = make_folder(truth + "/disparity/" + pair); !s) return s;
  if (Status s = make_folder(truth + "/mask/" + pair); !s) return s;
  Image<std::uint16_t> fixed(disparity.size());
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      const float d = disparity(x, y);
      const bool known = std::isfinite(d) && d > 0;
      fixed(x, y) = known ? static_cast<std::uint16_t>(std::min(65535.0F, std::round(d * 256.0F))) : std::uint16_t{0};
    }
  }
  if (Status s = write_png(truth + "/disparity" + name, fixed); !s) return s;
  return write_png(truth + "/mask" + name, mask);
}

Status RecordingWriter::finish() {
  if (Status s = state_->frames->flush(); !s) return s;
  for (auto& [name, table] : state_->sensors) {
    if (Status s = table.flush(); !s) return s;
  }
  const RecordingFile file{.schema = 1, .about = state_->options};
  return write_file_atomically(state_->folder + "/recording.yaml", dump_options(file));
}

}  // namespace spartan
