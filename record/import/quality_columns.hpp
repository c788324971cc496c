// SPDX-License-Identifier: Apache-2.0
// Assigns columns of qualities to the columns that they refer to.
//
//   FIC101.PV, FIC101.PV Quality    by its name, also Quality FIC101.PV, FIC101.PV_IsGood
//   FIC101.Quality                  of all signals of the loop
//   FIC101.PV, Quality, FIC101.OP   directly after its value
//   PV, SP, OP, Quality             one column after or before all signals: of the whole row
//   Tag, Time, Value, Quality       one row per value: all columns of qualities
#pragma once

#include <cstddef>
#include <set>
#include <vector>

#include "record/import/layout.hpp"

namespace loopwarden::record {

// Returns the qualities by column, for Layout::qualities_of. `loops`: named by the user.
// `with_words`: columns whose cells are words of qualities, under any name; for a table with one
// row per value.
std::vector<std::vector<std::size_t>> find_qualities(const Layout& layout,
                                                     const std::vector<LoopSignals>& loops,
                                                     const std::set<std::size_t>& with_words);

// Returns the columns of qualities that are used, in order.
std::vector<std::size_t> quality_columns(const Layout& layout);

}  // namespace loopwarden::record
