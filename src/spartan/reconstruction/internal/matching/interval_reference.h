// The kernels of interval_kernels.h in scalar C++: the reference of the tests, and the implementation on targets
// without SIMD.
#pragma once

#include "spartan/reconstruction/internal/matching/interval_kernels.h"

namespace spartan::internal::matching::reference {

void census_row(const CensusRow& row);
void cost_row(const CostRow& row);
void p2_row(const P2Row& row);
void vertical_row(const VerticalRow& row);
void apply(const TransitionRun& run);
void horizontal_rows(const HorizontalRows& rows);
void select_row(const SelectRow& row);

}  // namespace spartan::internal::matching::reference
