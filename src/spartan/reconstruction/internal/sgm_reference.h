// The kernels of sgm_kernels.h in scalar C++: the reference of the tests, and the implementation on targets without
// SIMD.
#pragma once

#include "spartan/reconstruction/internal/sgm_kernels.h"

namespace spartan::internal::sgm::reference {

void census_row(const CensusRow& row);
void cost_row(const CostRow& row);
PathMinima pixel_paths(const PixelPaths& paths);
int find_winner(const std::uint16_t* sums, int padded);

}  // namespace spartan::internal::sgm::reference
