#include "spartan/imaging/internal/debayer.h"

#include <mutex>
#include <stdexcept>
#include <vector>

#include "spartan/imaging/internal/debayer_kernels.h"
#include "spartan/numerics/simd_target.h"

namespace spartan::internal {
namespace {

constexpr int kDebayerRowsPerPart = 32;  // rows per task; does not affect results
constexpr int kRowsPerBand = 64;         // a band also processes up to seven rows above and below it

/// Idle band buffers for reuse: at most one per thread is ever allocated.
class BufferPool {
 public:
  std::unique_ptr<bayer::BandBuffers> take(int width) {
    const std::lock_guard lock(mutex_);
    while (!idle_.empty()) {
      auto buffers = std::move(idle_.back());
      idle_.pop_back();
      if (buffers->width() == width) return buffers;
    }
    return std::make_unique<bayer::BandBuffers>(width);
  }
  void give_back(std::unique_ptr<bayer::BandBuffers> buffers) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(buffers));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<bayer::BandBuffers>> idle_;
};

template <class T>
void run_bilinear(ImageView<const T> mosaic, BayerPhase phase, const bayer::Kernels<T>& kernels, auto result,
                  const ThreadPool& workers) {
  const int height = mosaic.height();
  workers.parallel_for(0, height, kDebayerRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const bayer::BilinearRow<T> row{mosaic.row(y > 0 ? y - 1 : 1),
                                      mosaic.row(y),
                                      mosaic.row(y + 1 < height ? y + 1 : y - 1),
                                      mosaic.width(),
                                      phase.is_red_row(y),
                                      phase.is_green(0, y)};
      if constexpr (std::is_same_v<decltype(result), ImageView<T>>) {
        kernels.bilinear_luma(row, result.row(y));
      } else {
        kernels.bilinear_colour(row, result.row(y));
      }
    }
  });
}

template <class T, class Pixel>
void run_edge_aware(ImageView<const T> mosaic, BayerPhase phase, const PixelFormat& format,
                    const bayer::Kernels<T>& kernels, ImageView<Pixel> result, BufferPool& pool,
                    const ThreadPool& workers) {
  workers.parallel_for(0, mosaic.height(), kRowsPerBand, [&](int begin, int end) {
    auto buffers = pool.take(mosaic.width());
    const bayer::Band<T, Pixel> band{mosaic, phase, format.full_scale(), result, begin, end};
    if constexpr (std::is_same_v<Pixel, T>) {
      kernels.edge_aware_luma(band, *buffers);
    } else {
      kernels.edge_aware_colour(band, *buffers);
    }
    pool.give_back(std::move(buffers));
  });
}

}  // namespace

struct Debayerer::State {
  DebayerMethod method;
  bayer::Kernels<std::uint8_t> kernels8;
  bayer::Kernels<std::uint16_t> kernels16;
  BufferPool pool;

  template <class T, class Pixel>
  void run(ImageView<const T> mosaic, const PixelFormat& format, ImageView<Pixel> result, const ThreadPool& workers) {
    const BayerPhase phase = bayer_phase(format.layout);
    if (format.bytes_per_sample() != sizeof(T))
      throw std::invalid_argument("debayer: the samples have another type than the format");
    if (mosaic.size() != result.size()) throw std::invalid_argument("debayer: the sizes differ");
    if (mosaic.width() < 2 || mosaic.height() < 2) {
      throw std::invalid_argument("debayer: the mosaic must have at least 2 × 2 samples");
    }
    const auto& kernels = [this]() -> const bayer::Kernels<T>& {
      if constexpr (sizeof(T) == 1) {
        return kernels8;
      } else {
        return kernels16;
      }
    }();
    if (method == DebayerMethod::bilinear) return run_bilinear(mosaic, phase, kernels, result, workers);
    run_edge_aware(mosaic, phase, format, kernels, result, pool, workers);
  }
};

Debayerer::Debayerer(DebayerMethod method, SimdTarget simd) : state_(std::make_unique<State>()) {
  const std::size_t target = simd_target_index(simd);
  state_->method = method;
  state_->kernels8 = bayer::kernels_for<std::uint8_t>(target);
  state_->kernels16 = bayer::kernels_for<std::uint16_t>(target);
}

Debayerer::Debayerer(Debayerer&&) noexcept = default;
Debayerer& Debayerer::operator=(Debayerer&&) noexcept = default;
Debayerer::~Debayerer() = default;

void Debayerer::apply(ImageView<const std::uint8_t> mosaic, const PixelFormat& format, ImageView<Rgb8> result,
                      const ThreadPool& workers) const {
  state_->run(mosaic, format, result, workers);
}
void Debayerer::apply(ImageView<const std::uint16_t> mosaic, const PixelFormat& format, ImageView<Rgb16> result,
                      const ThreadPool& workers) const {
  state_->run(mosaic, format, result, workers);
}
void Debayerer::apply(ImageView<const std::uint8_t> mosaic, const PixelFormat& format, ImageView<std::uint8_t> result,
                      const ThreadPool& workers) const {
  state_->run(mosaic, format, result, workers);
}
void Debayerer::apply(ImageView<const std::uint16_t> mosaic, const PixelFormat& format, ImageView<std::uint16_t> result,
                      const ThreadPool& workers) const {
  state_->run(mosaic, format, result, workers);
}

}  // namespace spartan::internal
