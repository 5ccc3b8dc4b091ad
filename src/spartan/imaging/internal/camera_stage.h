// Imaging stage of one camera: from the raw image to the rectified image.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "spartan/core/frame_image.h"
#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/imager.h"
#include "spartan/imaging/internal/contrast.h"
#include "spartan/imaging/internal/debayer.h"
#include "spartan/imaging/internal/local_contrast.h"
#include "spartan/imaging/internal/remap.h"
#include "spartan/imaging/internal/vignetting_correction.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// The self-mask of a camera as 0 or 255; empty where it has none. Code `configuration`: it cannot be read or has not
/// the camera's size.
Result<Image<std::uint8_t>> load_self_mask(const Camera& camera, const std::string& folder);

/// Buffers and lookup tables of one camera. The steps must be called in the order of their declaration, but rectify()
/// before apply_contrast() where rectifies_first(); the views of the result are valid until the next image.
class CameraStage {
 public:
  /// Code `configuration` where the self-mask cannot be read, the vignetting correction is out of range or the camera
  /// sees less than 1 % of the view. `where` names the pair in the last of these errors.
  static Result<CameraStage> create(const Camera& camera, const Rectification& plan,
                                    const Eigen::Matrix3d& camera_from_rectified, const ImagingOptions& options,
                                    const std::string& mask_folder, const ThreadPool& workers,
                                    const std::string& where);

  /// Code `input` where the size or pixel format differs from the camera's. The image of a gray camera may be RGB.
  Status check(const FrameImage& image, const std::string& where) const;

  bool has_vignetting() const { return vignetting_.has_value(); }
  bool has_local_contrast() const { return local_.has_value(); }
  bool is_resampled() const { return table_.has_value(); }
  /// Whether the gray image is rectified, not the working image: with more than 8 bits it is interpolated before it is
  /// rounded to 8. Local contrast needs the whole image of the camera.
  bool rectifies_first() const { return is_resampled() && is_deep() && !has_local_contrast(); }

  /// Raw image → gray image of the same depth.
  void make_gray(const FrameImage& image, const ThreadPool& workers);
  void correct_vignetting(const ThreadPool& workers);
  /// Adds the gray levels inside the rectified view and outside the self-mask to the histogram: neither the rover's own
  /// body nor the black border of a fisheye image represents the brightness of the ground.
  void add_to_histogram(GrayHistogram& histogram) const;
  /// Gray image → 8-bit working image.
  void apply_contrast(const ContrastMapping& mapping, const ThreadPool& workers);
  void equalise_locally(const ThreadPool& workers);
  void rectify(const ThreadPool& workers);

  ImageView<const std::uint8_t> result() const { return is_resampled() ? result_.view() : working(); }
  ImageView<const std::uint8_t> mask() const { return table_ ? table_->mask() : self_mask_.view(); }

 private:
  CameraStage(const Camera& camera, const ImagingOptions& options);
  Status check_mask(const std::string& where) const;
  void make_gray_buffer();
  bool is_deep() const { return camera_.pixel_format.bits > 8; }
  ImageView<const std::uint8_t> working() const { return local_ ? equalised_.view() : mapped_.view(); }
  template <class T>
  ImageView<const T> to_gray(const FrameImage& image, Image<T>& buffer, const ThreadPool& workers) const;

  Camera camera_;
  Debayerer debayerer_;
  std::optional<VignettingCorrection> vignetting_;
  std::optional<LocalContrast> local_;
  std::optional<RemapTable> table_;
  Image<std::uint8_t> gray8_, mapped_, equalised_, result_;
  Image<std::uint8_t> self_mask_, histogram_mask_;  ///< size of the sensor, 0: excluded; empty: nothing excluded
  Image<std::uint16_t> gray16_, rectified16_;
  ImageView<const std::uint8_t> gray8_view_;
  ImageView<const std::uint16_t> gray16_view_;
};

}  // namespace spartan::internal
