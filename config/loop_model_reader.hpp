// SPDX-License-Identifier: Apache-2.0
// Loop models: what the simulation believes of a loop. docs/configuration.md lists every key.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::config {

Loaded<plant::LoopModel> read_model_file(const std::filesystem::path& path);
// `file` is the name that diagnostics carry.
Loaded<plant::LoopModel> read_model_text(const std::string& file, std::string_view text);

KeyReference describe_model();

}  // namespace loopwarden::config
