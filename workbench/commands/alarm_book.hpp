// SPDX-License-Identifier: Apache-2.0
// The texts of `loopwarden alarms` about all alarms together.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/protocol/answers.hpp"

namespace loopwarden::workbench {

// Returns "2026-11-24 07:00:00", or "-" without a time.
std::string utc_text(std::int64_t utc_ms);

// Returns a CSV table for the plant's own alarm book, with one line per alarm and loop.
std::string rationalised_csv(const protocol::AlarmDesigns& designs);

// Returns the figures of ISA-18.2 as text, each with its target.
std::string figures_text(const protocol::AlarmFigures& figures);

}  // namespace loopwarden::workbench
