// SPDX-License-Identifier: Apache-2.0
// Reads monitor.corrective_action of a loop's file: the jacket, or planned moves.
#pragma once

#include "config/io_reader.hpp"
#include "config/loop_config.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {

// `controller` and the other keys of `monitor` must already be read.
void read_corrective_action(MapReader& in, const control::ControllerSettings& controller,
                            WindowCut& monitor);
// Checks that planned moves have a read-back, and limits on hardware.
void check_corrective_io(MapReader& in, const alarm::CorrectiveSettings& corrective,
                         const IoSection& io);
// Returns whether the corrective action is the jacket.
bool switches_on(const alarm::CorrectiveSettings& corrective) noexcept;

}  // namespace loopwarden::config
