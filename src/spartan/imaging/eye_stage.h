// One eye on its way from the sensor to the rectified view.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "spartan/core/frame_image.h"
#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/contrast.h"
#include "spartan/imaging/debayer.h"
#include "spartan/imaging/imaging_options.h"
#include "spartan/imaging/light_correction.h"
#include "spartan/imaging/local_contrast.h"
#include "spartan/imaging/rectification.h"
#include "spartan/imaging/remap.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// Buffers and tables of one eye. Its steps are called in the order in which they stand here; the views that they
/// leave are valid until the next image.
class EyeStage {
 public:
  /// Code `configuration` where the self-mask cannot be read, the vignetting leaves no light or the eye sees less than
  /// 1 % of the view. `where` names the pair in the last of these.
  static Result<EyeStage> create(const Camera& camera, const Rectification& plan,
                                 const Eigen::Matrix3d& camera_from_rectified, const ImagingOptions& options,
                                 const std::string& mask_folder, const Workers& workers, const std::string& where);

  /// Code `input` where the image has another size or format than the camera. A gray camera's image may be RGB.
  Status check(const FrameImage& image, const std::string& where) const;

  bool has_vignetting() const { return light_.has_value(); }
  bool has_local_contrast() const { return local_.has_value(); }
  bool is_resampled() const { return table_.has_value(); }

  /// Sensor → gray of the same depth.
  void make_gray(const FrameImage& image, const Workers& workers);
  void correct_light(const Workers& workers);
  /// The gray levels of what the view shows and is not the rover itself: neither its body nor the black around a
  /// fisheye's picture says how bright the ground is.
  void count(GrayHistogram& histogram) const;
  /// Gray → 8-bit working image.
  void map(const ContrastMapping& mapping, const Workers& workers);
  void equalise(const Workers& workers);
  void rectify(const Workers& workers);

  ImageView<const std::uint8_t> result() const { return table_ ? result_.view() : working(); }
  ImageView<const std::uint8_t> mask() const { return table_ ? table_->mask() : self_mask_.view(); }

 private:
  EyeStage(const Camera& camera, const ImagingOptions& options);
  Status check_mask(const std::string& where) const;
  void make_gray_buffer();
  bool is_deep() const { return camera_.pixel_format.bits > 8; }
  ImageView<const std::uint8_t> working() const { return local_ ? equalised_.view() : mapped_.view(); }
  template <class T>
  ImageView<const T> to_gray(const FrameImage& image, Image<T>& buffer, const Workers& workers) const;

  Camera camera_;
  Debayerer debayerer_;
  std::optional<LightCorrection> light_;
  std::optional<LocalContrast> local_;
  std::optional<RemapTable> table_;
  Image<std::uint8_t> gray8_, mapped_, equalised_, result_;
  Image<std::uint8_t> self_mask_, counted_;  ///< of the sensor, 0 where not; empty: everything
  Image<std::uint16_t> gray16_;
  ImageView<const std::uint8_t> gray8_view_;
  ImageView<const std::uint16_t> gray16_view_;
};

}  // namespace spartan
