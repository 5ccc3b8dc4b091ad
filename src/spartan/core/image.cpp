#include "spartan/core/image.h"

#include <sys/mman.h>

#include <new>

namespace spartan {

void* allocate_pixels(std::size_t bytes) {
  constexpr std::size_t kHugePage = std::size_t{2} << 20;
  const bool large = bytes >= 2 * kHugePage;
  void* memory = nullptr;
  if (posix_memalign(&memory, large ? kHugePage : 64, bytes) != 0) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
  if (large) madvise(memory, bytes, MADV_HUGEPAGE);  // where the system does not have them, small pages do
#endif
  return memory;
}

}  // namespace spartan
