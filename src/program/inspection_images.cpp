#include "program/inspection_images.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "spartan/camera/recording.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/imaging/imager.h"

namespace spartan::program {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg" || ending == ".pgm" || ending == ".ppm";
}

// The files that an argument names, sorted.
Result<std::vector<std::string>> files_of(const std::string& argument) {
  std::error_code error;
  const fs::path path(argument);
  const bool folder = fs::is_directory(path, error);
  const std::string pattern = folder ? "*" : path.filename().string();
  if (!folder && pattern.find_first_of("*?[") == std::string::npos) return std::vector<std::string>{argument};
  const fs::path where = folder ? path : path.parent_path().empty() ? fs::path(".") : path.parent_path();
  const auto names = list_folder(where.string());
  if (!names) return failure(names);
  std::vector<std::string> files;
  for (const std::string& name : *names) {
    if (is_image(name) && ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0) files.push_back((where / name).string());
  }
  if (files.empty()) return failure(ErrorCode::input, "no image file matches (png, jpg, pgm, ppm)", argument);
  return files;
}

// At most `most` indices of 0 … count − 1, evenly spread, including the first and the last.
std::vector<std::size_t> spread(std::size_t count, int most) {
  std::vector<std::size_t> places;
  const std::size_t wanted = std::min(count, static_cast<std::size_t>(std::max(most, 1)));
  places.reserve(wanted);
  for (std::size_t i = 0; i < wanted; ++i) places.push_back(wanted > 1 ? i * (count - 1) / (wanted - 1) : 0);
  return places;
}

// At most `most` pairs, spread evenly over the files that the two arguments name.
Result<std::vector<std::pair<std::string, std::string>>> pairs_of_files(const std::string& left,
                                                                        const std::string& right, int most) {
  const auto left_files = files_of(left);
  if (!left_files) return failure(left_files);
  const auto right_files = files_of(right);
  if (!right_files) return failure(right_files);
  if (left_files->size() != right_files->size()) {
    return failure(ErrorCode::input,
                   fmt::format("{} left and {} right images", left_files->size(), right_files->size()),
                   left + ", " + right, "every left image needs a right one");
  }
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const std::size_t i : spread(left_files->size(), most)) pairs.emplace_back((*left_files)[i], (*right_files)[i]);
  return pairs;
}

// The images must not depend on the calibration under test: sizes are those of the images, the camera model is
// arbitrary.
Result<Imager> imager_without_geometry(const Camera& left, const Camera& right, ImageSize size,
                                       const ThreadPool& workers) {
  const auto plain = [&](const char* name, const PixelFormat& format) {
    Camera camera;
    camera.name = name;
    camera.size = size;
    camera.pixel_format = format;
    const double focal_px = std::max(size.width, size.height);
    camera.model = PinholeModel{focal_px, focal_px, 0.5 * size.width, 0.5 * size.height};
    return camera;
  };
  ImagingOptions options;
  options.rectify = false;
  return Imager::create(rig_of_one_pair("images", plain("left", left.pixel_format), plain("right", right.pixel_format),
                                        Pose::from_translation({-0.1, 0, 0})),
                        options, workers);
}

}  // namespace

Result<std::vector<ImagePair>> load_images(const std::string& left, const std::string& right, int most) {
  const auto names = pairs_of_files(left, right, most);
  if (!names) return failure(names);
  std::vector<ImagePair> pairs;
  for (const auto& [l, r] : *names) {
    auto left_image = read_gray8(l);
    if (!left_image) return failure(left_image);
    auto right_image = read_gray8(r);
    if (!right_image) return failure(right_image);
    for (const auto& [path, size] : {std::pair{l, left_image->size()}, std::pair{r, right_image->size()}}) {
      const ImageSize first = pairs.empty() ? left_image->size() : pairs.front().left.size();
      if (size == first) continue;
      return failure(ErrorCode::input,
                     fmt::format("is {} x {} px, {} {} x {}", size.width, size.height,
                                 pairs.empty() ? l : pairs.front().name, first.width, first.height),
                     path);
    }
    pairs.push_back({l, std::move(*left_image), std::move(*right_image)});
  }
  return pairs;
}

Result<std::vector<ImagePair>> load_images_of(const Camera& left_camera, const Camera& right_camera,
                                              const std::string& left, const std::string& right, int most,
                                              const ThreadPool& workers) {
  const auto names = pairs_of_files(left, right, most);
  if (!names) return failure(names);
  std::vector<ImagePair> pairs;
  std::optional<Imager> imager;
  for (const auto& [l, r] : *names) {
    const auto left_file = read_image(l), right_file = read_image(r);
    if (!left_file) return failure(left_file);
    if (!right_file) return failure(right_file);
    StereoFrame frame;
    frame.left = interpret(*left_file, left_camera.pixel_format);
    frame.right = interpret(*right_file, right_camera.pixel_format);
    frame.pair = "stereo";  // the only one (rig_of_one_pair)
    if (!imager) {
      auto made = imager_without_geometry(left_camera, right_camera, left_file->size(), workers);
      if (!made) return failure(made);
      imager.emplace(std::move(*made));
    }
    const auto taken = imager->process(frame);
    if (!taken) return failure(taken);
    pairs.push_back({l, Image<std::uint8_t>::copy_of(taken->left), Image<std::uint8_t>::copy_of(taken->right)});
  }
  return pairs;
}

Result<std::vector<ImagePair>> load_frames(Recording& source, const std::string& pair, int most,
                                           const ThreadPool& workers) {
  ImagingOptions options;
  options.rectify = false;
  auto imager = Imager::create(source.info().rig, options, workers, source.info().mask_folder());
  if (!imager) return failure(imager);
  const std::vector<Stamp> stamps = source.listed_stamps(pair);
  std::vector<ImagePair> pairs;
  std::string reason = "the recording has no frame of this pair";
  for (const std::size_t i : spread(stamps.size(), most)) {
    auto frame = source.frame_at(pair, stamps[i]);
    if (!frame) {
      reason = frame.error().message();
      continue;
    }
    const auto taken = imager->process(*frame);
    if (!taken) {
      reason = taken.error().message();
      continue;
    }
    pairs.push_back({fmt::format("frame {}", frame->frame_id), Image<std::uint8_t>::copy_of(taken->left),
                     Image<std::uint8_t>::copy_of(taken->right)});
  }
  if (pairs.empty()) return failure(ErrorCode::input, fmt::format("pair {}: {}", pair, reason), source.info().path);
  return pairs;
}

}  // namespace spartan::program
