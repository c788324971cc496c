// SPDX-License-Identifier: Apache-2.0
// What `loopwarden alarms` says of the alarms as a whole.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/protocol/answers.hpp"

namespace loopwarden::workbench {

// "2026-11-24 07:00:00"; "-" where there is none.
std::string utc_text(std::int64_t utc_ms);

// CSV for the plant's own alarm book: a line for each alarm of each loop.
std::string rationalised_csv(const protocol::AlarmDesigns& designs);

// The figures of ISA-18.2, in words, each beside its target.
std::string figures_text(const protocol::AlarmFigures& figures);

}  // namespace loopwarden::workbench
