#include "viewer/frame_images.h"

#include <filesystem>
#include <utility>
#include <variant>

#include "spartan/image_io/image_io.h"

namespace spartan::viewer {
namespace {

bool is_there(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(path, error);
}

// Empty where it is not there, or not complete.
Result<FrameImage> read_side(const std::string& path, const Rig& rig, const std::string& camera) {
  if (path.empty()) return FrameImage();
  auto image = read_image(path);
  if (!image && image.error().code == ErrorCode::input) return FrameImage();
  if (!image) return failure(image);
  return interpret(*image, rig.find_camera(camera)->pixel_format);
}

RunInput accepting_unfinished(RunInput named) {
  named.open.unfinished = true;  // the recording of a live run that was killed
  return named;
}

}  // namespace

FrameImages::FrameImages(RunFolder run, const RunInput& named)
    : run_(std::move(run)),
      are_own_(named.recording.empty()),
      input_(complete_run_input(accepting_unfinished(named), run_)) {}

// A run that is resumed records into another folder.
RecordedImages FrameImages::find_own(const std::string& pair, Stamp stamp) const {
  RecordedImages found;
  for (int number = 1; found.left.empty() && found.right.empty() && is_there(run_.recording(number)); ++number)
    found = find_recorded_images(run_.recording(number), pair, stamp);
  return found;
}

bool FrameImages::exist() const {
  if (are_own_ && is_there(run_.recording(1))) return true;
  return !input_ || !input_->recording.empty();  // an error is told where an image is asked for
}

bool FrameImages::has_both(const std::string& pair, Stamp stamp) const {
  if (!are_own_ || !is_there(run_.recording(1))) return true;
  const RecordedImages found = find_own(pair, stamp);
  return !found.left.empty() && !found.right.empty();
}

Result<StereoFrame> FrameImages::read(const std::string& pair, Stamp stamp, const Rig& rig) {
  if (are_own_ && is_there(run_.recording(1))) {
    const StereoPair* const cameras = rig.find_pair(pair);
    if (cameras == nullptr) return failure(ErrorCode::input, "has no pair '" + pair + "'", run_.rig());
    const RecordedImages found = find_own(pair, stamp);
    auto left = read_side(found.left, rig, cameras->left), right = read_side(found.right, rig, cameras->right);
    if (!left) return failure(left);
    if (!right) return failure(right);
    if (left->empty() && right->empty()) return failure(ErrorCode::input, "has no image of this frame", run_.path);
    StereoFrame frame;
    frame.pair = pair;
    frame.left_stamp = frame.right_stamp = stamp;
    frame.left = std::move(*left);
    frame.right = std::move(*right);
    return frame;
  }
  if (!input_) return failure(input_);
  if (input_->recording.empty())
    return failure(ErrorCode::input, "does not state its recording", run_.path, "name it by --recording");
  if (!recording_) {
    auto opened = open_recording(input_->recording, input_->open);
    if (!opened) return failure(opened);
    recording_ = std::move(*opened);
  }
  auto found = recording_->sample_at(pair, stamp);
  if (!found) return failure(found);
  if (auto* whole = std::get_if<StereoFrame>(&*found)) return std::move(*whole);
  auto& missing = std::get<MissingFrame>(*found);
  if (missing.partial) return std::move(*missing.partial);
  return failure(ErrorCode::input, missing.message);
}

}  // namespace spartan::viewer
