// SPDX-License-Identifier: Apache-2.0
// The io section of a loop that another controller runs: where its values are read.
#pragma once

#include "config/io_reader.hpp"
#include "hal/contract/loop_source.hpp"

namespace loopwarden::config {

IoSection read_watched_io(MapReader& in, const IoContext& context);

// What the keys of such a section mean, whatever the backend.
inline constexpr const char* kWatchedPv = "the process variable";
inline constexpr const char* kWatchedCo = "the other controller's output";
inline constexpr const char* kWatchedSp =
    "its working set point; without it there are no windows, only routine evidence and a twin";
inline constexpr const char* kWatchedStem = "read-back of the valve's position";
inline constexpr const char* kWatchedMode = "its mode; without it the loop counts as in automatic";

// automatic and manual, of a mode. A register holds numbers; a feeder may bring words as well.
enum class ModeForm { numbers, numbers_and_words };
hal::ModeValues read_mode_values(MapReader& mode, ModeForm form);

}  // namespace loopwarden::config
