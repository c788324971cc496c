// SPDX-License-Identifier: Apache-2.0
// The specialists and twins that the loops' files name, loaded once each.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "config/diagnostic.hpp"
#include "config/loop_config.hpp"
#include "config/specialists/specialist_folder.hpp"
#include "model/monitor/window_builder.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::daemon {

struct Specialists {
  struct Folder {
    config::SpecialistFolder content;  // with a team; without the signature form
    std::uint32_t hash = 0;  // CRC-32 of its manifest, which has the digests of its weights
  };
  std::map<std::string, Folder> folders;            // by name
  std::uint32_t hash = 0;                           // CRC-32 of all manifests; 0: none
  std::map<std::string, plant::LoopModel> twins{};  // by file
};

// How a loop is cut into windows.
loopwarden::monitor::WindowSettings window_of(const config::LoopConfig& loop);

// Refuses folders that can't be trusted, specialists of another sample time than the loop's windows, and twins of another
// sample time or other ranges than the loop.
config::Loaded<Specialists> load_specialists(const config::Configuration& configuration);

}  // namespace loopwarden::daemon
