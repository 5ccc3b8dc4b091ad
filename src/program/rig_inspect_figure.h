// The figure of `rig inspect`: the row errors of a pair before and after correction.
#pragma once

#include "spartan/calibration/pair_check.h"
#include "spartan/core/frame_image.h"
#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"

namespace spartan::program {

/// Both images of one frame side by side, in three strips from top to bottom: unrectified, rectified with the given rig
/// (only a heading if that is impossible), rectified with the corrected rig (omitted if there is none). Lines mark
/// common rows. An arrow at each match points from the left row to the right row, enlarged kArrowScale times; gray
/// circles are outliers. `matches` are in pixels of the given images. Each image is reduced to at most 640 px in width.
Result<Image<Rgb8>> draw_pair_check(const Rig& rig, const StereoPair& pair, const PairCheck& check,
                                    ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                    const std::vector<PixelMatch>& matches, const ThreadPool& workers);

inline constexpr int kArrowScale = 10;

}  // namespace spartan::program
