// A rectified pair with images of its own.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/imaging/imager.h"

namespace spartan::internal {

/// A deep copy of a RectifiedPair, whose images are borrowed.
class StoredPair {
 public:
  explicit StoredPair(const RectifiedPair& source);
  /// Borrows the images of this copy.
  RectifiedPair view() const;

 private:
  RectifiedPair pair_;
  Image<std::uint8_t> left_, right_, left_mask_, right_mask_;
};

}  // namespace spartan::internal
