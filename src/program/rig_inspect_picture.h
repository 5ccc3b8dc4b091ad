// What `rig inspect` draws: a pair with its rows, before and after.
#pragma once

#include "spartan/core/image.h"
#include "spartan/core/pixel_format.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/inspection/pair_check.h"

namespace spartan::program {

/// Both pictures of one shot side by side, three times from top to bottom: as taken, rectified with the rig as given
/// (a heading alone where that cannot be done) and with the corrected one (left out where there is none); common rows
/// as lines, and at each match of this shot an arrow from the left eye's row to the right eye's, drawn kArrowScale
/// times as long as it is; gray rings at matches that are none. `matches`: of this shot, as the pictures were given.
/// The widths of the pictures are brought to at most 640 px each.
Result<Image<Rgb8>> draw_pair_check(const Rig& rig, const StereoPair& pair, const PairCheck& check,
                                    ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                    const std::vector<PixelMatch>& matches, const Workers& workers);

inline constexpr int kArrowScale = 10;

}  // namespace spartan::program
