#include "spartan/imaging/imager.h"

#include <fmt/format.h>

#include <map>
#include <stdexcept>

#include "spartan/imaging/internal/camera_stage.h"
#include "spartan/imaging/internal/contrast.h"

namespace spartan {

using namespace internal;

namespace {

/// Stages, histograms and mappings of one stereo pair.
struct PairStage {
  StereoPair pair;
  Rectification plan;
  CameraStage left, right;
  GrayHistogram left_histogram, right_histogram;
  ContrastMapping left_mapping, right_mapping;
};

VirtualView virtual_view(const ViewOptions& options, const Camera& left) {
  VirtualView view;
  view.policy = options.policy;
  if (options.width_px > 0 || options.height_px > 0) {
    view.size = {options.width_px > 0 ? options.width_px : left.size.width,
                 options.height_px > 0 ? options.height_px : left.size.height};
  }
  view.focal_px = options.focal_px;
  view.depth_m = options.depth_m;
  return view;
}

/// One contrast mapping for both images, after the gain that matches the right image to the left one. A missing image
/// has no gray levels.
void update_mappings(PairStage& stage, const ImagingOptions& options, const StereoFrame& frame) {
  stage.left_histogram.clear();
  stage.right_histogram.clear();
  if (!frame.left.empty()) stage.left.add_to_histogram(stage.left_histogram);
  if (!frame.right.empty()) stage.right.add_to_histogram(stage.right_histogram);
  const bool compensates = options.gain_compensation && !frame.left.empty() && !frame.right.empty();
  const double gain = compensates ? gain_between(stage.left_histogram, stage.right_histogram) : 1;
  stage.left_histogram.add(stage.right_histogram, gain);
  stage.left_mapping.stretch(stage.left_histogram, options.contrast_low_percent, options.contrast_high_percent);
  stage.right_mapping.copy_with_gain(stage.left_mapping, gain);
}

}  // namespace

struct Imager::State {
  Rig rig;
  ImagingOptions options;
  ThreadPool workers;
  std::map<std::string, PairStage> pairs;
  StageClock clock;

  Status add_pair(const StereoPair& pair, const std::string& mask_folder) {
    const Camera& left = *rig.find_camera(pair.left);
    const Camera& right = *rig.find_camera(pair.right);
    const std::string where = rig.name + ": pairs." + pair.name;
    const Pose right_from_left = rig.right_from_left(pair);
    if (left.pixel_format.bits != right.pixel_format.bits ||
        left.pixel_format.alignment != right.pixel_format.alignment) {
      return failure(ErrorCode::configuration, "the two cameras have different bit depth or bit alignment", where);
    }
    Result<Rectification> plan =
        options.rectify ? plan_rectification(left, right, right_from_left, where, virtual_view(options.view, left))
                        : assume_rectified(left, right_from_left);
    if (!plan) return failure(plan);
    if (plan->is_identity && left.size != right.size) {
      return failure(ErrorCode::configuration,
                     "the cameras have different image sizes, so their images cannot be already rectified", where);
    }
    auto left_stage = CameraStage::create(left, *plan, plan->left_from_rectified, options, mask_folder, workers, where);
    if (!left_stage) return failure(left_stage);
    auto right_stage =
        CameraStage::create(right, *plan, plan->right_from_rectified, options, mask_folder, workers, where);
    if (!right_stage) return failure(right_stage);
    const GrayHistogram histogram(left.pixel_format);
    const ContrastMapping mapping(left.pixel_format);
    pairs.emplace(pair.name, PairStage{pair, *plan, std::move(*left_stage), std::move(*right_stage), histogram,
                                       histogram, mapping, mapping});
    return {};
  }

  /// Runs all steps on the images that are there and measures their durations.
  void process(PairStage& stage, const StereoFrame& frame) {
    CameraStage &left = stage.left, &right = stage.right;
    const bool has_left = !frame.left.empty(), has_right = !frame.right.empty();
    const auto step = [&](const char* name, bool wanted, auto work) {
      if (wanted) clock.measure(name, work);
    };
    const auto each = [&](auto work) {
      return [&, work] {
        if (has_left) work(left, frame.left, stage.left_mapping);
        if (has_right) work(right, frame.right, stage.right_mapping);
      };
    };
    const auto make_gray = each([&](CameraStage& camera, const FrameImage& image, const ContrastMapping&) {
      camera.make_gray(image, workers);
    });
    // A raw gray image needs no conversion, so its time is not reported.
    const bool has_colour =
        frame.left.format().layout != PixelLayout::gray || frame.right.format().layout != PixelLayout::gray;
    step("imaging.debayer", has_colour, make_gray);
    if (!has_colour) make_gray();
    step("imaging.vignetting", left.has_vignetting() || right.has_vignetting(),
         each([&](CameraStage& camera, auto&&...) { camera.correct_vignetting(workers); }));
    const auto rectify = each([&](CameraStage& camera, auto&&...) { camera.rectify(workers); });
    step("imaging.rectify", left.rectifies_first(), rectify);
    step("imaging.contrast", true, [&] {
      if (options.contrast) update_mappings(stage, options, frame);
      each([&](CameraStage& camera, const FrameImage&, const ContrastMapping& mapping) {
        camera.apply_contrast(mapping, workers);
      })();
    });
    step("imaging.local_contrast", left.has_local_contrast(),
         each([&](CameraStage& camera, auto&&...) { camera.equalise_locally(workers); }));
    step("imaging.rectify", left.is_resampled() && !left.rectifies_first(), rectify);
  }
};

Result<Imager> Imager::create(const Rig& rig, const ImagingOptions& options, ThreadPool workers,
                              const std::string& mask_folder) {
  if (Status status = validate(options, "imaging options"); !status) return failure(status);
  if (Status status = rig.validate(rig.name); !status) return failure(status);
  auto state = std::make_unique<State>(State{rig, options, std::move(workers), {}, {}});
  for (const StereoPair& pair : state->rig.pairs) {
    if (Status status = state->add_pair(pair, mask_folder); !status) return failure(status);
  }
  return Imager(std::move(state));
}

Imager::Imager(std::unique_ptr<State> state) : state_(std::move(state)) {}
Imager::Imager(Imager&&) noexcept = default;
Imager& Imager::operator=(Imager&&) noexcept = default;
Imager::~Imager() = default;

Result<RectifiedPair> Imager::process(const StereoFrame& frame) {
  const std::string where = fmt::format("frame {}", frame.frame_id);
  const auto found = state_->pairs.find(frame.pair);
  if (found == state_->pairs.end()) {
    return failure(ErrorCode::frame_rejected, fmt::format("the rig has no stereo pair '{}'", frame.pair), where);
  }
  PairStage& stage = found->second;
  if (frame.left.empty() && frame.right.empty())
    return failure(ErrorCode::frame_rejected, "both images are missing", where);
  if (Status status = stage.left.check(frame.left, where); !frame.left.empty() && !status) return failure(status);
  if (Status status = stage.right.check(frame.right, where); !frame.right.empty() && !status) return failure(status);
  state_->process(stage, frame);

  const Pose body_from_camera = state_->rig.body_from_camera(stage.pair.left, frame.pan_rad, frame.tilt_rad);
  return RectifiedPair{stage.pair.name,
                       frame.left_stamp,
                       stage.plan.geometry,
                       frame.left.empty() ? ImageView<const std::uint8_t>() : stage.left.result(),
                       frame.right.empty() ? ImageView<const std::uint8_t>() : stage.right.result(),
                       stage.left.mask(),
                       stage.right.mask(),
                       state_->clock.take(),
                       body_from_camera * Pose(stage.plan.left_from_rectified, Eigen::Vector3d::Zero())};
}

RectifiedStereo Imager::geometry(const std::string& pair) const {
  const auto found = state_->pairs.find(pair);
  if (found == state_->pairs.end()) throw std::invalid_argument("Imager::geometry: no pair '" + pair + "'");
  return found->second.plan.geometry;
}

}  // namespace spartan
