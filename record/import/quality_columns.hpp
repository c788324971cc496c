// SPDX-License-Identifier: Apache-2.0
// Which columns of a table have the qualities of which others.
//
//   FIC101.PV, FIC101.PV Quality    by its name, also Quality FIC101.PV, FIC101.PV_IsGood
//   FIC101.Quality                  of all signals of the loop
//   FIC101.PV, Quality, FIC101.OP   directly after its value
//   PV, SP, OP, Quality             one column after or before all signals: of the whole row
//   Tag, Time, Value, Quality       a row a value: all columns of qualities
#pragma once

#include <cstddef>
#include <set>
#include <vector>

#include "record/import/layout.hpp"

namespace loopwarden::record {

// By column, for Layout::qualities_of. `loops`: named by the user. `with_words`: columns whose
// cells are words of qualities, whatever the name is; for a table with a row per value.
std::vector<std::vector<std::size_t>> find_qualities(const Layout& layout,
                                                     const std::vector<LoopSignals>& loops,
                                                     const std::set<std::size_t>& with_words);

// The columns of qualities that are used, in order.
std::vector<std::size_t> quality_columns(const Layout& layout);

}  // namespace loopwarden::record
