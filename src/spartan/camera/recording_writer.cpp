#include "spartan/camera/recording_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/internal/layouts/spartan_format.h"
#include "spartan/camera/internal/table.h"
#include "spartan/core/files.h"
#include "spartan/core/options.h"
#include "spartan/image_io/image_io.h"

namespace spartan {

using namespace internal;

namespace {

namespace fs = std::filesystem;

// A text file that is appended row by row.
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
  Status sync() {
    if (Status flushed = flush(); !flushed) return flushed;
    return ::fsync(::fileno(file_.get())) == 0 ? Status{} : fault();
  }

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

// Without waiting for the disk.
Status write_plain(const std::string& path, std::string_view content) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "wb"), &std::fclose);
  if (!file) return write_failure(path, errno);
  std::setvbuf(file.get(), nullptr, _IONBF, 0);
  if (std::fwrite(content.data(), 1, content.size(), file.get()) == content.size()) return {};
  return write_failure(path, errno);
}

Status sync_file(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return write_failure(path, errno);
  const int error = ::fsync(file) == 0 ? 0 : errno;
  ::close(file);
  return error == 0 ? Status() : write_failure(path, error);
}

Status write_image(const std::string& path, const FrameImage& image) {
  return write_file_atomically(path, to_png(image));
}

// Why the image of one camera cannot be stored without loss; empty where it can.
std::string format_mismatch(const FrameImage& image, const Camera& camera) {
  if (image.size() != camera.size) {
    return fmt::format("is {}x{}, but camera '{}' in the rig is {}x{}", image.width(), image.height(), camera.name,
                       camera.size.width, camera.size.height);
  }
  const PixelFormat& format = image.format();
  if (format.layout == PixelLayout::rgb) {
    return format.bits == 8 ? "" : "is RGB of more than 8 bits, which cannot be recorded; record the Bayer image";
  }
  const PixelLayout expected =
      camera.pixel_format.layout == PixelLayout::rgb ? PixelLayout::gray : camera.pixel_format.layout;
  if (format.layout != expected) {
    return fmt::format("is {}, but the layout of camera '{}' in the rig is {}", name_of(format.layout), camera.name,
                       name_of(expected));
  }
  if (format.bits > 8 && format.alignment != camera.pixel_format.alignment) {
    return fmt::format("has another bit alignment than camera '{}' in the rig", camera.name);
  }
  return {};
}

std::string image_stem(const std::string& pair, Stamp left_stamp) {
  return fmt::format("images/{}/{}", pair, left_stamp.ns);
}

constexpr const char* kPreviousRowsFile = "/frames.csv.before";

// The complete rows of a frames.csv (its last row may be truncated), by left image.
std::map<std::string, std::string> rows_by_left_image(const std::string& table) {
  std::map<std::string, std::string> rows;
  constexpr std::size_t kColumns = 12, kLeft = 5;
  for (std::size_t from = table.find('\n') + 1, to; (to = table.find('\n', from)) != std::string::npos; from = to + 1) {
    const std::string row = table.substr(from, to - from);
    std::vector<std::string> fields(1);
    for (const char c : row) {
      if (c == ',') {
        fields.emplace_back();
      } else {
        fields.back() += c;
      }
    }
    if (fields.size() == kColumns) rows[fields[kLeft]] = row;
  }
  return rows;
}

bool is_folder_name(const std::string& name) {
  return !name.empty() && name.front() != '.' && name.find_first_of("/\\,\"# \t\r\n") == std::string::npos;
}

bool all_finite(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

// In the folder and in all folders below it.
void remove_temporary_files_below(const std::string& folder) {
  remove_temporary_files(folder);
  for (const std::string& name : list_folder(folder).value_or(std::vector<std::string>())) {
    const std::string path = (folder / fs::path(name)).string();
    std::error_code ignored;
    if (fs::is_directory(fs::symlink_status(path, ignored))) remove_temporary_files_below(path);
  }
}

}  // namespace

struct RecordingWriter::State {
  std::string folder;
  FolderLock lock;
  RecordingOptions options;
  Rig rig;
  std::optional<TableFile> frames;
  std::map<std::string, std::string> previous_rows;  // rows of the interrupted run: left image → row
  std::map<std::string, TableFile> sensors;
  bool has_new_tables = false;        // of sensors, whose names are not on disk yet
  std::map<std::string, Stamp> last;  // last stamp of each pair and each sensor
  bool batched = false;
  ImageFiles images = ImageFiles::png;
  std::vector<std::string> unsynced;  // paths of images
  std::vector<std::string> unlisted;  // rows of their frames

  tl::unexpected<Error> reject(const std::string& who, Stamp stamp, const std::string& why) const {
    return failure(ErrorCode::input, fmt::format("{} at {} s {}", who, to_decimal_seconds(stamp), why), folder);
  }

  // Checks that the stamp comes after the last one of `who` (a pair or a sensor file).
  Status check_stamp(const std::string& who, Stamp stamp) const {
    if (!is_in_range(stamp)) return reject(who, stamp, "is out of range");
    const auto found = last.find(who);
    if (found == last.end() || stamp > found->second) return {};
    return reject(who, stamp,
                  fmt::format("does not come after the previous stamp, {} s", to_decimal_seconds(found->second)));
  }

  Status check(const StereoFrame& frame, bool partial) const {
    const StereoPair* pair = rig.find_pair(frame.pair);
    if (!pair) return failure(ErrorCode::input, "the rig has no pair '" + frame.pair + "'", folder);
    if (Status s = check_stamp(frame.pair, frame.left_stamp); !s) return s;
    if (!is_in_range(frame.right_stamp)) return reject(frame.pair, frame.right_stamp, "is out of range");
    if (!all_finite({frame.pan_rad, frame.tilt_rad, frame.exposure_us, frame.gain}))
      return reject(frame.pair, frame.left_stamp, "has an angle, exposure or gain that is not finite");
    for (const auto& [image, camera] : {std::pair{&frame.left, &pair->left}, std::pair{&frame.right, &pair->right}}) {
      if (partial && image->empty()) continue;
      const std::string why = format_mismatch(*image, *rig.find_camera(*camera));
      if (!why.empty()) return reject("image of '" + *camera + "'", frame.left_stamp, why);
    }
    if (!partial && frame.left.format().bits != frame.right.format().bits)
      return reject(frame.pair, frame.left_stamp, "has left and right images of different bit depth");
    return {};
  }

  Status write(const std::string& path, const FrameImage& image) {
    if (!batched) return write_image(path, image);
    unsynced.push_back(path);
    return write_plain(path, images == ImageFiles::pnm ? to_pnm(image) : to_png(image));
  }

  // Appends a row of `stamp` and the numbers; creates the table at its first row.
  Status append_sensor(const std::string& name, const char* header, Stamp stamp,
                       std::initializer_list<double> numbers) {
    if (Status s = check_stamp(name, stamp); !s) return s;
    if (!all_finite(numbers)) return reject(name, stamp, "has a number that is not finite");
    auto found = sensors.find(name);
    if (found == sensors.end()) {
      if (Status s = make_folder(folder + "/sensors"); !s) return s;
      auto table = TableFile::create(folder + "/sensors/" + name, header);
      if (!table) return failure(table);
      found = sensors.emplace(name, std::move(*table)).first;
      has_new_tables = true;
    }
    std::string row = std::to_string(stamp.ns);
    for (const double number : numbers) row += fmt::format(",{}", number);
    last[name] = stamp;
    return found->second.append(row);
  }
};

RecordingWriter::RecordingWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;
RecordingWriter::~RecordingWriter() = default;

Result<RecordingWriter> RecordingWriter::create(const std::string& folder, const Rig& nominal_rig,
                                                const RecordingOptions& options) {
  std::error_code error;
  if (fs::exists(folder, error) && !(fs::is_directory(folder, error) && fs::is_empty(folder, error))) {
    return failure(ErrorCode::output, "already exists and is not overwritten", folder, "choose another folder");
  }
  return open(folder, nominal_rig, options, {}, {});
}

Result<RecordingWriter> RecordingWriter::create_batched(const std::string& folder, const Rig& nominal_rig,
                                                        const RecordingOptions& options, ImageFiles images) {
  auto writer = create(folder, nominal_rig, options);
  if (!writer) return writer;
  const RecordingFile file{.schema = 1, .about = options};
  if (Status s = write_file_atomically(folder + "/" + kUnfinishedFile, dump_options(file)); !s) return failure(s);
  writer->state_->batched = true;
  writer->state_->images = images;
  return writer;
}

Result<RecordingWriter> RecordingWriter::resume(const std::string& folder, const Rig& nominal_rig,
                                                const RecordingOptions& options) {
  std::error_code error;
  std::map<std::string, std::string> rows;
  FolderLock lock;
  if (fs::exists(folder + "/frames.csv", error)) {
    auto acquired = FolderLock::acquire(folder, FolderLock::kOfKilledProcess);
    if (!acquired) return failure(acquired);
    lock = std::move(*acquired);
    remove_temporary_files_below(folder);
    const auto table = read_file(folder + "/frames.csv");
    if (!table) return failure(table);
    for (const auto& [file, kind] :
         {std::pair{kFinishedFile, "finished recording"}, {kUnfinishedFile, "recording of a stream"}}) {
      if (!fs::exists(folder + "/" + file, error)) continue;
      return failure(ErrorCode::output, fmt::format("is a {} and is not overwritten", kind), folder,
                     "choose another folder");
    }
    // A resumed run may be interrupted as well: rows that it has not reached yet are kept in a file of their own.
    rows = rows_by_left_image(*table);
    if (const auto kept = read_file(folder + kPreviousRowsFile)) rows.merge(rows_by_left_image(*kept));
    std::string text = std::string(kFramesHeader) + "\n";
    for (const auto& [image, row] : rows) text += row + "\n";
    if (Status s = write_file_atomically(folder + kPreviousRowsFile, text); !s) return failure(s);
  } else if (fs::exists(folder, error) && !fs::is_empty(folder, error)) {
    return failure(ErrorCode::output, "is not an unfinished recording and is not overwritten", folder,
                   "choose another folder");
  }
  return open(folder, nominal_rig, options, std::move(rows), std::move(lock));
}

Result<RecordingWriter> RecordingWriter::open(const std::string& folder, const Rig& nominal_rig,
                                              const RecordingOptions& options,
                                              std::map<std::string, std::string> previous_rows, FolderLock lock) {
  if (Status s = nominal_rig.validate("rig of the recording"); !s) return failure(s);
  if (Status s = validate(internal::RecordingFile{1, options}, "description of the recording"); !s) return failure(s);
  for (const StereoPair& pair : nominal_rig.pairs) {
    if (is_folder_name(pair.name)) continue;
    return failure(ErrorCode::configuration, "the name of pair '" + pair.name + "' is not usable as a folder name",
                   folder);
  }
  if (Status s = make_folder(folder); !s) return failure(s);
  if (!lock.owns()) {
    auto acquired = FolderLock::acquire(folder);
    if (!acquired) return failure(acquired);
    lock = std::move(*acquired);
  }
  // The first file to be created: resume() recognises an unfinished recording by it, however early it was interrupted.
  auto frames = TableFile::create(folder + "/frames.csv", kFramesHeader);
  if (!frames) return failure(frames);
  for (const StereoPair& pair : nominal_rig.pairs) {
    if (Status s = make_folder(folder + "/images/" + pair.name); !s) return failure(s);
  }
  if (Status s = write_file_atomically(folder + "/rig.yaml", to_rig_yaml(nominal_rig)); !s) return failure(s);
  auto state = std::make_unique<State>();
  state->folder = folder;
  state->lock = std::move(lock);
  state->options = options;
  state->rig = nominal_rig;
  state->frames.emplace(std::move(*frames));
  state->previous_rows = std::move(previous_rows);
  return RecordingWriter(std::move(state));
}

RecordedImages find_recorded_images(const std::string& folder, const std::string& pair, Stamp left_stamp) {
  const std::string stem = folder + "/" + image_stem(pair, left_stamp);
  RecordedImages found;
  std::error_code error;
  for (const char* extension : {".pnm", ".png"}) {
    for (const auto& [path, side] : {std::pair{&found.left, "_left"}, {&found.right, "_right"}}) {
      if (fs::exists(stem + side + extension, error)) *path = stem + side + extension;
    }
  }
  return found;
}

Result<bool> RecordingWriter::reuse_frame(const std::string& pair, Stamp left_stamp) {
  const auto row = state_->previous_rows.find(image_stem(pair, left_stamp) + "_left.png");
  const RecordedImages images = find_recorded_images(state_->folder, pair, left_stamp);
  if (row == state_->previous_rows.end() || images.left.empty() || images.right.empty()) return false;
  if (Status s = state_->check_stamp(pair, left_stamp); !s) return failure(s);
  state_->last[pair] = left_stamp;
  if (Status s = state_->frames->append(row->second); !s) return failure(s);
  if (Status s = state_->frames->flush(); !s) return failure(s);
  return true;
}

Status RecordingWriter::add(const StereoFrame& frame) {
  if (Status s = state_->check(frame, false); !s) return s;
  return add_images(frame);
}

Status RecordingWriter::add_partial(const StereoFrame& frame) {
  if (Status s = state_->check(frame, true); !s) return s;
  if (frame.left.empty() == frame.right.empty())
    return state_->reject(frame.pair, frame.left_stamp, "has not one image");
  return add_images(frame);
}

// Those that are not empty.
Status RecordingWriter::add_images(const StereoFrame& frame) {
  const std::string stem = image_stem(frame.pair, frame.left_stamp);
  const char* const extension = state_->images == ImageFiles::png ? ".png" : ".pnm";
  const std::string left = stem + "_left" + extension, right = stem + "_right" + extension;
  for (const auto& [path, image] : {std::pair{&left, &frame.left}, std::pair{&right, &frame.right}}) {
    if (image->empty()) continue;
    if (Status s = state_->write(state_->folder + "/" + *path, *image); !s) return s;
  }
  state_->last[frame.pair] = frame.left_stamp;
  const std::string row = fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}", frame.frame_id, frame.position_id,
                                      frame.pair, frame.left_stamp.ns, frame.right_stamp.ns, left, right,
                                      to_degrees(frame.pan_rad), to_degrees(frame.tilt_rad), frame.exposure_us,
                                      frame.gain, (frame.left.empty() ? frame.right : frame.left).format().bits);
  if (state_->batched) {
    state_->unlisted.push_back(row);
    return {};
  }
  if (Status s = state_->frames->append(row); !s) return s;
  return state_->frames->flush();
}

Status RecordingWriter::sync() {
  State& state = *state_;
  for (const std::string& path : state.unsynced) {
    if (Status s = sync_file(path); !s) return s;
  }
  if (!state.unsynced.empty()) {
    for (const StereoPair& pair : state.rig.pairs) {
      if (Status s = sync_folder(state.folder + "/images/" + pair.name); !s) return s;
    }
  }
  state.unsynced.clear();
  for (const std::string& row : state.unlisted) {
    if (Status s = state.frames->append(row); !s) return s;
  }
  state.unlisted.clear();
  if (Status s = state.frames->sync(); !s) return s;
  for (auto& [name, table] : state.sensors) {
    if (Status s = table.sync(); !s) return s;
  }
  if (state.has_new_tables) {
    if (Status s = sync_folder(state.folder + "/sensors"); !s) return s;
  }
  state.has_new_tables = false;
  return {};
}

Status RecordingWriter::add(const ImuSample& s) {
  const Eigen::Vector3d &gyro = s.gyro_rad_s, &accel = s.accel_m_s2;
  return state_->append_sensor("imu.csv", kImuHeader, s.stamp,
                               {gyro.x(), gyro.y(), gyro.z(), accel.x(), accel.y(), accel.z()});
}
Status RecordingWriter::add(const WheelSample& s) {
  return state_->append_sensor("wheels.csv", kWheelsHeader, s.stamp, {s.left_m, s.right_m});
}
Status RecordingWriter::add(const CompassSample& s) {
  return state_->append_sensor("compass.csv", kCompassHeader, s.stamp, {s.heading_rad, s.sigma_rad});
}
Status RecordingWriter::add(const InclinometerSample& s) {
  return state_->append_sensor("inclinometer.csv", kInclinometerHeader, s.stamp,
                               {s.roll_rad, s.pitch_rad, s.sigma_rad});
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
  if (Status s = sync(); !s) return s;
  std::error_code ignored;
  fs::remove(state_->folder + kPreviousRowsFile, ignored);
  const RecordingFile file{.schema = 1, .about = state_->options};
  state_->lock = {};  // before the last file: a process that is killed after it leaves a finished recording
  if (Status s = write_file_atomically(state_->folder + "/" + kFinishedFile, dump_options(file)); !s) return s;
  fs::remove(state_->folder + "/" + kUnfinishedFile, ignored);
  return {};
}

}  // namespace spartan
