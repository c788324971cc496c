// SPDX-License-Identifier: Apache-2.0
// Which column of an export has the times, and how they are written.
#pragma once

#include <string>

#include "record/import/export_head.hpp"
#include "record/import/layout.hpp"

namespace loopwarden::record {

// Sets `time` and `form` of the layout, whose delimiter and decimal are known. Throws RecordError.
void find_time(const ExportHead& head, const ImportOptions& options, Layout& layout);
// Sets `clock` where the dates have no time of day. After the header was found.
void find_clock(const ExportHead& head, const ImportOptions& options, Layout& layout);
// Of times that are plain numbers: sets `form` to what they count, or `hint`. After the header was found.
void settle_form(const ExportHead& head, const ImportOptions& options, Layout& layout);

// What times in seconds with this step may be instead, as a sentence; empty: nothing else.
std::string other_time_units(double step_s);

}  // namespace loopwarden::record
