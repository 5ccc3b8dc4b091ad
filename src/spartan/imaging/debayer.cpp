#include "spartan/imaging/debayer.h"

#include <mutex>
#include <stdexcept>
#include <vector>

#include "spartan/core/simd_target.h"
#include "spartan/imaging/debayer_kernels.h"

namespace spartan {
namespace {

constexpr int kRowsPerPart = 32;
constexpr int kRowsPerBand = 64;  // a band computes up to seven rows beyond its own

/// Memory of bands that nobody works in at present: as many as there are threads, made once.
class MemoryPool {
 public:
  std::unique_ptr<bayer::BandMemory> take(int width) {
    const std::lock_guard lock(mutex_);
    while (!free_.empty()) {
      auto memory = std::move(free_.back());
      free_.pop_back();
      if (memory->width() == width) return memory;
    }
    return std::make_unique<bayer::BandMemory>(width);
  }
  void give_back(std::unique_ptr<bayer::BandMemory> memory) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(memory));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<bayer::BandMemory>> free_;
};

template <class T>
void run_bilinear(ImageView<const T> mosaic, RedPlace red, const bayer::Kernels<T>& kernels, auto result,
                  const Workers& workers) {
  const int height = mosaic.height();
  workers.for_each_part(0, height, kRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const bayer::BilinearRow<T> row{mosaic.row(y > 0 ? y - 1 : 1),
                                      mosaic.row(y),
                                      mosaic.row(y + 1 < height ? y + 1 : y - 1),
                                      mosaic.width(),
                                      red.is_red_row(y),
                                      red.is_green(0, y)};
      if constexpr (std::is_same_v<decltype(result), ImageView<T>>) {
        kernels.bilinear_luma(row, result.row(y));
      } else {
        kernels.bilinear_colour(row, result.row(y));
      }
    }
  });
}

template <class T, class Pixel>
void run_edge_aware(ImageView<const T> mosaic, RedPlace red, const PixelFormat& format,
                    const bayer::Kernels<T>& kernels, ImageView<Pixel> result, MemoryPool& pool,
                    const Workers& workers) {
  workers.for_each_part(0, mosaic.height(), kRowsPerBand, [&](int begin, int end) {
    auto memory = pool.take(mosaic.width());
    const bayer::Band<T, Pixel> band{mosaic, red, format.full_scale(), result, begin, end};
    if constexpr (std::is_same_v<Pixel, T>) {
      kernels.edge_aware_luma(band, *memory);
    } else {
      kernels.edge_aware_colour(band, *memory);
    }
    pool.give_back(std::move(memory));
  });
}

}  // namespace

struct Debayerer::State {
  DebayerMethod method;
  bayer::Kernels<std::uint8_t> kernels8;
  bayer::Kernels<std::uint16_t> kernels16;
  MemoryPool pool;

  template <class T, class Pixel>
  void run(ImageView<const T> mosaic, const PixelFormat& format, ImageView<Pixel> result, const Workers& workers) {
    const RedPlace red = red_place(format.layout);
    if (format.bytes_per_sample() != sizeof(T)) throw std::invalid_argument("debayer: the samples are of another kind");
    if (mosaic.size() != result.size()) throw std::invalid_argument("debayer: the sizes differ");
    if (mosaic.width() < 2 || mosaic.height() < 2) {
      throw std::invalid_argument("debayer: a mosaic has at least 2 × 2 samples");
    }
    const auto& kernels = [this]() -> const bayer::Kernels<T>& {
      if constexpr (sizeof(T) == 1) {
        return kernels8;
      } else {
        return kernels16;
      }
    }();
    if (method == DebayerMethod::bilinear) return run_bilinear(mosaic, red, kernels, result, workers);
    run_edge_aware(mosaic, red, format, kernels, result, pool, workers);
  }
};

Debayerer::Debayerer(DebayerMethod method, const std::string& simd) : state_(std::make_unique<State>()) {
  const std::size_t target = simd_target_index(simd);
  state_->method = method;
  state_->kernels8 = bayer::kernels_for<std::uint8_t>(target);
  state_->kernels16 = bayer::kernels_for<std::uint16_t>(target);
}

Debayerer::Debayerer(Debayerer&&) noexcept = default;
Debayerer& Debayerer::operator=(Debayerer&&) noexcept = default;
Debayerer::~Debayerer() = default;

void Debayerer::apply(ImageView<const std::uint8_t> mosaic, const PixelFormat& format, ImageView<Rgb8> result,
                      const Workers& workers) const {
  state_->run(mosaic, format, result, workers);
}
void Debayerer::apply(ImageView<const std::uint16_t> mosaic, const PixelFormat& format, ImageView<Rgb16> result,
                      const Workers& workers) const {
  state_->run(mosaic, format, result, workers);
}
void Debayerer::apply(ImageView<const std::uint8_t> mosaic, const PixelFormat& format, ImageView<std::uint8_t> result,
                      const Workers& workers) const {
  state_->run(mosaic, format, result, workers);
}
void Debayerer::apply(ImageView<const std::uint16_t> mosaic, const PixelFormat& format, ImageView<std::uint16_t> result,
                      const Workers& workers) const {
  state_->run(mosaic, format, result, workers);
}

}  // namespace spartan
