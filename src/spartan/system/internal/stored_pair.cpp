#include "spartan/system/internal/stored_pair.h"

namespace spartan::internal {

StoredPair::StoredPair(const RectifiedPair& source)
    : pair_(source),
      left_(Image<std::uint8_t>::copy_of(source.left)),
      right_(Image<std::uint8_t>::copy_of(source.right)),
      left_mask_(Image<std::uint8_t>::copy_of(source.left_mask)),
      right_mask_(Image<std::uint8_t>::copy_of(source.right_mask)) {}

RectifiedPair StoredPair::view() const {
  RectifiedPair copy = pair_;
  copy.left = left_;
  copy.right = right_;
  copy.left_mask = left_mask_;
  copy.right_mask = right_mask_;
  return copy;
}

}  // namespace spartan::internal
