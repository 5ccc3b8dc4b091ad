// Imaging: from raw camera images to rectified gray pairs.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/stage_clock.h"
#include "spartan/core/threads.h"
#include "spartan/core/time.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// How missing colours of a Bayer mosaic are interpolated (demosaicing).
enum class DebayerMethod : std::uint8_t {
  /// The rounded mean of the two or four nearest samples of the colour.
  bilinear,
  /// Green minus red (or blue) is interpolated along rows and along columns. The two are averaged with weights that
  /// fall
  /// with the local gradient of the difference (docs/math/imaging.md). Red and blue follow from green, interpolated
  /// mostly along the direction with the weaker edges.
  edge_aware,
};
constexpr auto enum_names(DebayerMethod) {
  return std::array{EnumName{DebayerMethod::bilinear, "bilinear"}, EnumName{DebayerMethod::edge_aware, "edge_aware"}};
}

/// Which part of the two fields of view the rectified images cover.
enum class ViewPolicy : std::uint8_t {
  keep_resolution,  ///< the cameras' resolution on their optical axes; pixels outside of a sensor are masked
  all_valid,        ///< the widest view in which both cameras see every pixel; nothing is masked
  whole_view,       ///< everything that either camera sees, at lower resolution and with masked pixels
};
constexpr auto enum_names(ViewPolicy) {
  return std::array{EnumName{ViewPolicy::keep_resolution, "keep_resolution"},
                    EnumName{ViewPolicy::all_valid, "all_valid"}, EnumName{ViewPolicy::whole_view, "whole_view"}};
}

struct LocalContrastOptions {
  bool enabled = false;   ///< whether to apply CLAHE
  int tiles = 8;          ///< tiles along each side of the image
  double clip_limit = 2;  ///< largest count of a gray level in a tile, as a multiple of the mean count

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled,
            "True applies contrast-limited adaptive histogram equalisation (CLAHE) to each image on its own; false is "
            "better "
            "for stereo matching, since the same surface may get different gray levels in the left and right image.");
    v.field("tiles", tiles,
            "Number of CLAHE tiles along each side of the image; raising it adapts the contrast to smaller regions and "
            "amplifies noise there.",
            between(1, 64));
    v.renamed("clip", "clip_limit");
    v.field("clip_limit", clip_limit,
            "Largest count of a gray level in a CLAHE tile as a multiple of the mean count; raising it allows stronger "
            "contrast and more noise.",
            between(1, 256));
  }
};

struct ViewOptions {
  ViewPolicy policy = ViewPolicy::keep_resolution;  ///< which part of the fields of view is shown
  int width_px = 0, height_px = 0;                  ///< size of the rectified images, px; 0: as the left camera
  double focal_px = 0;                              ///< focal length of the rectified images, px; 0: by the policy
  double depth_m = 0;  ///< depth for which non-central cameras are rectified, m; 0: infinity

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "policy", policy,
        "Part of the fields of view that the rectified images cover: keep_resolution keeps the resolution of the "
        "cameras and masks pixels outside of a sensor, all_valid is the widest view in which both cameras see every "
        "pixel, whole_view covers the union of both fields of view at a lower resolution.");
    v.field("width_px", width_px,
            "Width of the rectified images in px; 0 takes the width of the left camera, raising it covers more (or "
            "finer) ground and costs time.",
            between(0, 32767));
    v.field("height_px", height_px,
            "Height of the rectified images in px; 0 takes the height of the left camera, raising it covers more (or "
            "finer) ground and costs time.",
            between(0, 32767));
    v.field("focal_px", focal_px,
            "Focal length of the rectified images in px; 0 lets the policy choose it, raising it narrows the view and "
            "increases the resolution.",
            between(0, 1e6));
    v.field("depth_m", depth_m,
            "Depth in m at which rectification is exact for non-central cameras (CAHVORE), whose rays do not meet in "
            "one point; 0 means infinity, central cameras ignore it.",
            between(0, 1e6));
  }
};

struct ImagingOptions {
  DebayerMethod debayer = DebayerMethod::edge_aware;  ///< interpolation of Bayer mosaics
  bool vignetting = true;                             ///< whether to correct the vignetting given in the rig
  bool contrast = true;                               ///< whether to stretch the gray levels
  bool gain_compensation = true;                      ///< whether to match the brightness of right and left image
  double contrast_low_percent = 0.1;                  ///< percentile of the gray levels that becomes black, %
  double contrast_high_percent = 99.9;                ///< percentile of the gray levels that becomes white, %
  LocalContrastOptions local_contrast;
  bool rectify = true;  ///< whether to undistort and rectify
  ViewOptions view;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("debayer", debayer,
            "Interpolation of Bayer mosaics: bilinear is faster, edge_aware keeps edges sharper and free of false "
            "colours.");
    v.field("vignetting", vignetting,
            "True corrects the vignetting that the rig gives for a camera; false leaves the image darker towards its "
            "edges.");
    v.field(
        "contrast", contrast,
        "True stretches the gray levels linearly between two percentiles, with the same mapping for both images; false "
        "scales the full range of the sensor to 8 bits and also disables gain_compensation.");
    v.renamed("balance", "gain_compensation");
    v.field(
        "gain_compensation", gain_compensation,
        "True multiplies the gray levels of the right image by a gain that matches the left image before the stretch, "
        "where their histograms differ by more than 5 %; false keeps the brightness difference of the cameras.");
    v.field("contrast_low_percent", contrast_low_percent,
            "Percentile of the gray levels in % that is mapped to black; raising it darkens more pixels to black and "
            "raises the contrast of the rest.",
            between(0, 50));
    v.field(
        "contrast_high_percent", contrast_high_percent,
        "Percentile of the gray levels in % that is mapped to white; lowering it saturates more pixels to white and "
        "raises the contrast of the rest.",
        between(50, 100));
    v.group("local_contrast", local_contrast);
    v.field("rectify", rectify,
            "Undistorts and rectifies the images; false treats the input as already rectified, whatever the rig says.");
    v.group("view", view);
  }
};

/// Requested geometry of the rectified images. Zero: chosen by the policy; size: that of the left image.
struct VirtualView {
  ViewPolicy policy = ViewPolicy::keep_resolution;
  ImageSize size{};
  double focal_px = 0;
  /// Depth at which the view is exact, m; 0: infinity. It only matters for non-central cameras, whose rays do not meet
  /// in one point.
  double depth_m = 0;

  /// Whether a size or a focal length is given.
  bool is_customized() const { return !size.empty() || focal_px != 0; }
};

/// Two virtual pinhole views with common rows. `left_from_rectified` rotates directions of the rectified left view into
/// the frame of the real left camera; `right_from_rectified` likewise.
struct Rectification {
  RectifiedStereo geometry;
  Eigen::Matrix3d left_from_rectified = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d right_from_rectified = Eigen::Matrix3d::Identity();
  double depth_m = 1;        ///< depth at which the view is exact, m; irrelevant for central cameras
  bool is_identity = false;  ///< the images are already rectified: no resampling
};

/// Computes the rectification of a pair. Axes: rectifying_axes(). Focal length, principal point and size:
/// choose_view(); by default the view keeps resolution and centre of the cameras and masks pixels outside of a sensor,
/// since a view of valid pixels only costs resolution or field of view with strong distortion. Cameras that are already
/// rectified (two equal pinholes without distortion, within 0.02 px) give the identity, unless a size or focal length
/// is given. Code `configuration`: a baseline more vertical or more along the optical axis than horizontal, left and
/// right camera swapped, optical axes more than 60° apart, or an impossible view. `where` names the pair in errors.
Result<Rectification> plan_rectification(const Camera& left, const Camera& right, const Pose& right_from_left,
                                         const std::string& where, const VirtualView& view = {});

/// The geometry under the assumption that the images are already rectified, whatever the rig says: focal length and
/// principal point of the left camera, length of the baseline.
Rectification assume_rectified(const Camera& left, const Pose& right_from_left);

/// Two rectified images with common rows, 8-bit gray after the contrast step. The views borrow the buffers of their
/// producer (an `Imager` keeps them until its next frame of the pair).
struct RectifiedPair {
  std::string pair;
  Stamp stamp;  ///< of the left image
  RectifiedStereo geometry;
  ImageView<const std::uint8_t> left, right;
  /// 255 where the pixel is inside the sensor and outside the self-mask, else 0; empty: valid everywhere.
  ImageView<const std::uint8_t> left_mask, right_mask;
  std::vector<StageTime> times;  ///< durations of the steps ("imaging.debayer" …), for reports only
  Pose body_from_left;           ///< pose of the rectified left optical frame at the pan and tilt of this frame
};

/// Converts stereo frames to rectified pairs. Holds one rectification table and image buffers per camera; its results
/// do not depend on earlier frames.
class Imager {
 public:
  /// Code `configuration` where options are out of bounds, a pair cannot be rectified (diverging optical axes, an
  /// impossible view, a camera that sees less than 1 % of the view), a self-mask cannot be read or a vignetting
  /// correction is out of range. `mask_folder` is the folder of the rig file, to which the names of self-masks are
  /// relative.
  static Result<Imager> create(const Rig& rig, const ImagingOptions& options, ThreadPool workers,
                               const std::string& mask_folder = {});
  Imager(Imager&&) noexcept;
  Imager& operator=(Imager&&) noexcept;
  ~Imager();

  /// The image views of the result are valid until the next call for the same pair. Code `frame_rejected` where the
  /// pair of the frame is unknown, an image has another size or pixel format than its camera in the rig, or both are
  /// missing. RGB images of a gray camera are converted to gray. Of a missing image the view is empty.
  Result<RectifiedPair> process(const StereoFrame& frame);

  /// Geometry of the rectified images of a pair. Throws where there is no such pair.
  RectifiedStereo geometry(const std::string& pair) const;

 private:
  struct State;
  explicit Imager(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
