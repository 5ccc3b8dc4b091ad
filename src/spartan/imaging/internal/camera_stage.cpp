#include "spartan/imaging/internal/camera_stage.h"

#include <fmt/format.h>

#include <filesystem>

#include "spartan/image_io/image_io.h"
#include "spartan/imaging/internal/view_footprint.h"
#include "spartan/numerics/luma.h"

namespace spartan::internal {
namespace {

constexpr int kLumaRowsPerPart = 64;  // rows per task; does not affect results

std::string describe(ImageSize size, const PixelFormat& format) {
  std::string text = fmt::format("{} × {} {} of {} bits", size.width, size.height, name_of(format.layout), format.bits);
  if (format.bits > 8) text += format.alignment == BitAlignment::high ? ", high alignment" : ", low alignment";
  return text;
}

template <class T>
void reduce_to_luma(ImageView<const Rgb<T>> colour, ImageView<T> gray, const ThreadPool& workers) {
  workers.parallel_for(0, colour.height(), kLumaRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const Rgb<T>* const in = colour.row(y);
      T* const out = gray.row(y);
      for (int x = 0; x < colour.width(); ++x) out[x] = luma(in[x]);
    }
  });
}

// Sets pixels outside of the mask to 0.
void keep_where(ImageView<std::uint8_t> pixels, ImageView<const std::uint8_t> mask) {
  for (int y = 0; y < pixels.height(); ++y) {
    for (int x = 0; x < pixels.width(); ++x) pixels(x, y) &= mask(x, y);
  }
}

}  // namespace

Result<Image<std::uint8_t>> load_self_mask(const Camera& camera, const std::string& folder) {
  if (camera.self_mask.empty()) return Image<std::uint8_t>();
  const std::string path = (std::filesystem::path(folder) / camera.self_mask).string();
  auto mask = read_gray8(path);
  if (!mask) {
    mask.error().code = ErrorCode::configuration;
    return failure(mask);
  }
  if (mask->size() != camera.size) {
    return failure(ErrorCode::configuration,
                   fmt::format("the self-mask is {} × {}, but camera '{}' is {} × {}", mask->width(), mask->height(),
                               camera.name, camera.size.width, camera.size.height),
                   path);
  }
  for (int y = 0; y < mask->height(); ++y) {
    for (int x = 0; x < mask->width(); ++x) (*mask)(x, y) = (*mask)(x, y) == 0 ? 0 : 255;
  }
  return mask;
}

CameraStage::CameraStage(const Camera& camera, const ImagingOptions& options)
    : camera_(camera), debayerer_(options.debayer), mapped_(camera.size) {
  if (options.local_contrast.enabled) {
    local_.emplace(options.local_contrast.tiles, options.local_contrast.clip_limit);
    equalised_ = Image<std::uint8_t>(camera.size);
  }
}

Result<CameraStage> CameraStage::create(const Camera& camera, const Rectification& plan,
                                        const Eigen::Matrix3d& camera_from_rectified, const ImagingOptions& options,
                                        const std::string& mask_folder, const ThreadPool& workers,
                                        const std::string& where) {
  auto mask = load_self_mask(camera, mask_folder);
  if (!mask) return failure(mask);
  CameraStage stage(camera, options);
  if (options.vignetting && !camera.vignetting.coefficients.empty()) {
    auto light = VignettingCorrection::create(camera, workers);
    if (!light) return failure(light);
    stage.vignetting_ = std::move(*light);
  }
  // A raw gray image is used in place, without a copy.
  if (camera.pixel_format.layout != PixelLayout::gray || stage.vignetting_) stage.make_gray_buffer();
  stage.self_mask_ = std::move(*mask);
  if (plan.is_identity) {
    if (Status status = stage.check_mask(where); !status) return failure(status);
    return stage;
  }
  stage.table_.emplace(camera.model, camera.size, plan.geometry, camera_from_rectified, stage.self_mask_, workers,
                       plan.depth_m);
  if (Status status = stage.check_mask(where); !status) return failure(status);
  stage.result_ = Image<std::uint8_t>(plan.geometry.size);
  if (stage.rectifies_first()) stage.rectified16_ = Image<std::uint16_t>(plan.geometry.size);
  stage.histogram_mask_ = view_footprint(camera, plan.geometry, camera_from_rectified, plan.depth_m);
  if (!stage.self_mask_.empty()) keep_where(stage.histogram_mask_, stage.self_mask_);
  return stage;
}

Status CameraStage::check_mask(const std::string& where) const {
  constexpr double kLeastPercent = 1;  // of the pixels of the view must be valid; empirical
  const auto seen = mask();
  if (seen.empty()) return {};
  std::int64_t count = 0;
  for (int y = 0; y < seen.height(); ++y) {
    for (int x = 0; x < seen.width(); ++x) count += seen(x, y) != 0 ? 1 : 0;
  }
  const double percent = 100 * static_cast<double>(count) / (static_cast<double>(seen.width()) * seen.height());
  if (percent >= kLeastPercent) return {};
  return failure(ErrorCode::configuration, fmt::format("camera '{}' sees {:.1f} % of the view", camera_.name, percent),
                 where,
                 "check the transforms of the two cameras and the self-masks, or choose another view (imaging.view)");
}

void CameraStage::make_gray_buffer() {
  if (is_deep() && gray16_.empty()) gray16_ = Image<std::uint16_t>(camera_.size);
  if (!is_deep() && gray8_.empty()) gray8_ = Image<std::uint8_t>(camera_.size);
}

Status CameraStage::check(const FrameImage& image, const std::string& where) const {
  PixelFormat format = image.format();
  // Many calibration formats cannot state that a camera delivers colour.
  const bool reduced = format.layout == PixelLayout::rgb && camera_.pixel_format.layout == PixelLayout::gray;
  if (reduced) format.layout = PixelLayout::gray;
  if (image.size() == camera_.size && format == camera_.pixel_format) return {};
  return failure(ErrorCode::frame_rejected,
                 fmt::format("the image of camera '{}' is {}, but the rig specifies {}", camera_.name,
                             describe(image.size(), image.format()), describe(camera_.size, camera_.pixel_format)),
                 where, "correct size_px and the pixel format in the rig, or use images of this camera");
}

template <class T>
ImageView<const T> CameraStage::to_gray(const FrameImage& image, Image<T>& buffer, const ThreadPool& workers) const {
  const PixelLayout layout = image.format().layout;
  if (layout == PixelLayout::gray) return image.as<T>();
  if (layout == PixelLayout::rgb) {
    reduce_to_luma<T>(image.as<Rgb<T>>(), buffer, workers);
  } else {
    debayerer_.apply(image.as<T>(), image.format(), buffer, workers);
  }
  return buffer;
}

void CameraStage::make_gray(const FrameImage& image, const ThreadPool& workers) {
  if (image.format().layout != PixelLayout::gray) make_gray_buffer();
  if (is_deep()) {
    gray16_view_ = to_gray<std::uint16_t>(image, gray16_, workers);
  } else {
    gray8_view_ = to_gray<std::uint8_t>(image, gray8_, workers);
  }
}

void CameraStage::correct_vignetting(const ThreadPool& workers) {
  if (!vignetting_) return;
  if (is_deep()) {
    vignetting_->apply(gray16_view_, gray16_, workers);
    gray16_view_ = gray16_;
  } else {
    vignetting_->apply(gray8_view_, gray8_, workers);
    gray8_view_ = gray8_;
  }
}

void CameraStage::add_to_histogram(GrayHistogram& histogram) const {
  const auto where = histogram_mask_.empty() ? self_mask_.view() : histogram_mask_.view();
  if (is_deep()) return histogram.add(gray16_view_, where);
  histogram.add(gray8_view_, where);
}

void CameraStage::apply_contrast(const ContrastMapping& mapping, const ThreadPool& workers) {
  if (rectifies_first()) return mapping.apply(rectified16_, result_, workers);
  if (is_deep()) return mapping.apply(gray16_view_, mapped_, workers);
  mapping.apply(gray8_view_, mapped_, workers);
}

void CameraStage::equalise_locally(const ThreadPool& workers) {
  if (local_) local_->apply(mapped_, equalised_, workers);
}

void CameraStage::rectify(const ThreadPool& workers) {
  if (rectifies_first()) {
    table_->apply(gray16_view_, rectified16_, workers);
  } else if (table_) {
    table_->apply(working(), result_, workers);
  }
}

}  // namespace spartan::internal
