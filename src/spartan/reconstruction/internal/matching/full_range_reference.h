// The kernels of full_range_kernels.h in scalar C++: the reference of the tests, and the implementation on targets
// without SIMD.
#pragma once

#include "spartan/reconstruction/internal/matching/full_range_kernels.h"

namespace spartan::internal::matching::reference {

void cost_row(const FullCostRow& row);
void vertical_row(const FullVerticalRow& row);
void horizontal_rows(const FullHorizontalRows& rows);
int find_winner(const std::uint16_t* sums, int levels);

}  // namespace spartan::internal::matching::reference
