#include "spartan/imaging/imager.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>

#include "spartan/core/image_io.h"
#include "spartan/imaging/contrast.h"
#include "spartan/imaging/debayer.h"
#include "spartan/imaging/rectification.h"
#include "spartan/imaging/remap.h"

namespace spartan {
namespace {

constexpr int kRowsPerPart = 64;

std::string describe(ImageSize size, const PixelFormat& format) {
  std::string text = fmt::format("{} × {} {} of {} bits", size.width, size.height, name_of(format.layout), format.bits);
  if (format.bits > 8) text += format.alignment == BitAlignment::high ? ", high alignment" : ", low alignment";
  return text;
}

template <class T>
void reduce_to_luma(ImageView<const Rgb<T>> colour, ImageView<T> gray, const Workers& workers) {
  workers.for_each_part(0, colour.height(), kRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < colour.width(); ++x) gray(x, y) = luma(colour(x, y));
    }
  });
}

/// One eye: its buffers, its table, and the steps on its way from the sensor to the rectified view.
class EyeStage {
 public:
  EyeStage(const Camera& camera, ImageSize result_size, DebayerMethod method)
      : camera_(camera), debayerer_(method), mapped_(camera.size), result_(result_size) {
    const bool is_gray = camera.pixel_format.layout == PixelLayout::gray;
    if (!is_gray && camera.pixel_format.bits > 8) gray16_ = Image<std::uint16_t>(camera.size);
    if (!is_gray && camera.pixel_format.bits <= 8) gray8_ = Image<std::uint8_t>(camera.size);
  }

  void set_table(RemapTable table) { table_ = std::move(table); }
  void set_mask(Image<std::uint8_t> mask) { self_mask_ = std::move(mask); }
  ImageView<const std::uint8_t> mask() const { return table_ ? table_->mask() : self_mask_.view(); }
  ImageView<const std::uint8_t> result() const { return table_ ? result_.view() : mapped_.view(); }

  Status check(const FrameImage& image, const std::string& where) const {
    if (image.size() == camera_.size && image.format() == camera_.pixel_format) return {};
    return failure(ErrorCode::input,
                   fmt::format("the image of camera '{}' is {}, the rig says {}", camera_.name,
                               describe(image.size(), image.format()), describe(camera_.size, camera_.pixel_format)),
                   where, "correct size_px and the pixel format in the rig, or take images that fit");
  }

  /// Sensor → gray of the same depth, counted into the histogram.
  void debayer_and_count(const FrameImage& image, GrayHistogram* histogram, const Workers& workers) {
    if (camera_.pixel_format.bits > 8) {
      gray16_view_ = to_gray<std::uint16_t>(image, gray16_, workers);
      if (histogram) histogram->add(gray16_view_);
    } else {
      gray8_view_ = to_gray<std::uint8_t>(image, gray8_, workers);
      if (histogram) histogram->add(gray8_view_);
    }
  }

  /// Gray → 8-bit working image → rectified view.
  void map_and_rectify(const ContrastMapping& mapping, const Workers& workers) {
    if (camera_.pixel_format.bits > 8) {
      mapping.apply(gray16_view_, mapped_, workers);
    } else {
      mapping.apply(gray8_view_, mapped_, workers);
    }
    if (table_) table_->apply(mapped_, result_, workers);
  }

 private:
  template <class T>
  ImageView<const T> to_gray(const FrameImage& image, Image<T>& buffer, const Workers& workers) const {
    const PixelLayout layout = camera_.pixel_format.layout;
    if (layout == PixelLayout::gray) return image.as<T>();
    if (layout == PixelLayout::rgb) {
      reduce_to_luma<T>(image.as<Rgb<T>>(), buffer, workers);
    } else {
      debayerer_.apply(image.as<T>(), layout, buffer.view(), workers);
    }
    return buffer;
  }

  Camera camera_;
  Debayerer debayerer_;
  Image<std::uint8_t> gray8_, mapped_, result_, self_mask_;
  Image<std::uint16_t> gray16_;
  ImageView<const std::uint8_t> gray8_view_;
  ImageView<const std::uint16_t> gray16_view_;
  std::optional<RemapTable> table_;
};

/// Everything that belongs to one stereo pair.
struct PairStage {
  StereoPair pair;
  Rectification plan;
  EyeStage left, right;
  GrayHistogram histogram;
  ContrastMapping mapping;
};

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
                   fmt::format("the self-mask is {} × {}, the camera '{}' has {} × {}", mask->width(), mask->height(),
                               camera.name, camera.size.width, camera.size.height),
                   path);
  }
  for (int y = 0; y < mask->height(); ++y) {
    for (int x = 0; x < mask->width(); ++x) (*mask)(x, y) = (*mask)(x, y) == 0 ? 0 : 255;
  }
  return mask;
}

Result<EyeStage> make_eye(const Camera& camera, const Rectification& plan, const Eigen::Matrix3d& camera_from_rectified,
                          const std::string& mask_folder, DebayerMethod method, const Workers& workers) {
  auto mask = load_self_mask(camera, mask_folder);
  if (!mask) return failure(mask);
  if (plan.passes_through) {
    EyeStage eye(camera, {}, method);
    eye.set_mask(std::move(*mask));
    return eye;
  }
  EyeStage eye(camera, plan.geometry.size, method);
  eye.set_table({camera.model, camera.size, plan.geometry, camera_from_rectified, *mask, workers});
  return eye;
}

}  // namespace

struct Imager::State {
  Rig rig;
  ImagingOptions options;
  Workers workers;
  std::map<std::string, PairStage> pairs;

  Status add_pair(const StereoPair& pair, const std::string& mask_folder) {
    const Camera& left = *rig.find_camera(pair.left);
    const Camera& right = *rig.find_camera(pair.right);
    const std::string where = rig.name + ": pairs." + pair.name;
    const Pose right_from_left = rig.right_from_left(pair);
    if (left.pixel_format.bits != right.pixel_format.bits ||
        left.pixel_format.alignment != right.pixel_format.alignment) {
      return failure(ErrorCode::configuration, "the two eyes have pixels of different depth", where);
    }
    Result<Rectification> plan = options.rectify ? plan_rectification(left, right, right_from_left, where)
                                                 : assume_rectified(left, right_from_left);
    if (!plan) return failure(plan);
    if (plan->passes_through && left.size != right.size) {
      return failure(ErrorCode::configuration, "images of different size cannot be rectified already", where);
    }
    const auto method = options.debayer == "bilinear" ? DebayerMethod::bilinear : DebayerMethod::edge_aware;
    auto left_eye = make_eye(left, *plan, plan->left_from_rectified, mask_folder, method, workers);
    if (!left_eye) return failure(left_eye);
    auto right_eye = make_eye(right, *plan, plan->right_from_rectified, mask_folder, method, workers);
    if (!right_eye) return failure(right_eye);
    pairs.emplace(pair.name, PairStage{pair, *plan, std::move(*left_eye), std::move(*right_eye),
                                       GrayHistogram(left.pixel_format), ContrastMapping(left.pixel_format)});
    return {};
  }
};

Result<Imager> Imager::create(const Rig& rig, const ImagingOptions& options, Workers workers,
                              const std::string& mask_folder) {
  if (Status status = rig.validate(rig.name); !status) return failure(status);
  auto state = std::make_unique<State>(State{rig, options, std::move(workers), {}});
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
    return failure(ErrorCode::input, fmt::format("the rig has no stereo pair '{}'", frame.pair), where);
  }
  PairStage& stage = found->second;
  if (Status status = stage.left.check(frame.left, where); !status) return failure(status);
  if (Status status = stage.right.check(frame.right, where); !status) return failure(status);

  const Workers& workers = state_->workers;
  GrayHistogram* histogram = state_->options.contrast ? &stage.histogram : nullptr;
  stage.histogram.clear();
  stage.left.debayer_and_count(frame.left, histogram, workers);
  stage.right.debayer_and_count(frame.right, histogram, workers);
  if (histogram) {
    stage.mapping.stretch(stage.histogram, state_->options.contrast_low_percent, state_->options.contrast_high_percent);
  }
  stage.left.map_and_rectify(stage.mapping, workers);
  stage.right.map_and_rectify(stage.mapping, workers);

  const Pose body_from_camera = state_->rig.body_from_camera(stage.pair.left, frame.pan_rad, frame.tilt_rad);
  return RectifiedPair{
      stage.pair.name,      frame.left_stamp,
      stage.plan.geometry,  stage.left.result(),
      stage.right.result(), stage.left.mask(),
      stage.right.mask(),   body_from_camera * Pose(stage.plan.left_from_rectified, Eigen::Vector3d::Zero())};
}

RectifiedStereo Imager::geometry(const std::string& pair) const {
  const auto found = state_->pairs.find(pair);
  if (found == state_->pairs.end()) throw std::invalid_argument("Imager::geometry: no pair '" + pair + "'");
  return found->second.plan.geometry;
}

}  // namespace spartan
