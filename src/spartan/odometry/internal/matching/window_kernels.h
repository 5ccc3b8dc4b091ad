// Inner loops of the alignment of patches, compiled for each instruction set.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "spartan/core/image.h"

namespace spartan::internal {

/// Windows are 13×13 pixels; patches carry one more pixel on each side for the gradients.
inline constexpr int kWindowRadius = 6;
inline constexpr int kWindowSide = 2 * kWindowRadius + 1;
inline constexpr int kWindowArea = kWindowSide * kWindowSide;
inline constexpr int kPatchSide = kWindowSide + 2;
/// Rows of windows and patches in memory: 16 columns, so that they are whole vectors.
inline constexpr int kWindowStride = 16;
/// Fewest and most windows that are combined with an image at once.
inline constexpr int kMinFactors = 3, kMaxFactors = 5;

/// Values over a window, row by row; columns behind the thirteenth hold 0.
struct alignas(64) Window {
  std::array<float, static_cast<std::size_t>(kWindowSide* kWindowStride)> values{};
};

/// Gaussian weights (σ = 4 px) with sum 1.
const Window& window_weights();

/// Where the pixels of a window lie in a smoothed image (gray levels times 256): an offset (i, j) from the centre of
/// the window at (x + xx i + xy j, y + yx i + yy j). All of them must lie in [0, width − 1) × [0, height − 1).
struct WindowPlace {
  ImageView<const std::uint16_t> image;
  float x = 0, y = 0, xx = 1, xy = 0, yx = 0, yy = 1;
};

/// Sums over the window with the weights w of window_weights(): Σ w I, Σ w I² and Σ f I for each factor f.
struct WindowSums {
  float mean = 0, square = 0;
  std::array<float, kMaxFactors> products{};
};

/// Sums of the gray levels I of an image, less `level`, by bilinear interpolation. `factors` holds `count` windows, 3
/// to 5.
WindowSums window_sums(const WindowPlace& place, float level, const Window* factors, int count);

/// Gray levels of a window and their derivatives along x and y (central differences).
struct WindowGradients {
  Window value, along_x, along_y;
};
/// Of the window around (x, y) of an image. The pixels around it must lie in the image as well.
WindowGradients window_gradients(ImageView<const std::uint16_t> image, float x, float y);
/// Of the window in the middle of a patch: kPatchSide rows of kWindowStride pixels, and one row behind them.
WindowGradients patch_gradients(const std::uint16_t* patch);

/// Mean and variance of a window under its weights.
struct WindowStatistics {
  float mean = 0, variance = 0;
};
/// Subtracts the weighted mean.
WindowStatistics subtract_mean(Window& window);

}  // namespace spartan::internal
