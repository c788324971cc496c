// SPDX-License-Identifier: Apache-2.0
// Reads the io section of a loop that another controller runs: the sources of its values.
#pragma once

#include "config/io_reader.hpp"
#include "hal/contract/loop_source.hpp"

namespace loopwarden::config {

IoSection read_watched_io(MapReader& in, const IoContext& context);

// Meanings of the keys of such a section, for all backends.
inline constexpr const char* kWatchedPv = "the process variable";
inline constexpr const char* kWatchedCo = "the other controller's output";
inline constexpr const char* kWatchedSp =
    "its working set point; without it there are no windows, only routine evidence and a twin";
inline constexpr const char* kWatchedStem = "read-back of the valve's position";
inline constexpr const char* kWatchedMode = "its mode; without it the loop counts as in automatic";

// Reads the modes automatic and manual. A register has numbers only; a feeder may send words as
// well.
enum class ModeForm { numbers, numbers_and_words };
hal::ModeValues read_mode_values(MapReader& mode, ModeForm form);

}  // namespace loopwarden::config
