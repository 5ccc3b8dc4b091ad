// Alignment of the rows of the stereo pairs of a stream, by its first frames.
#pragma once

#include <string>
#include <vector>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

struct AlignedRig {
  Rig rig;
  std::vector<std::string> sentences;  ///< one for each pair that was corrected
};

/// The rig of the stream, with each pair for which align_rows() finds a rotation of the right camera needed and
/// certain corrected by it. It uses five frames of each pair, spread over its first 40, and skips those that cannot be
/// read. Other codes than `input` of reading frames are passed on.
Result<AlignedRig> align_rows_of(SampleStream& source, const ThreadPool& workers);

}  // namespace spartan::internal
