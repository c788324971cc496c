// SPDX-License-Identifier: Apache-2.0
// Reads loop models: the assumptions of the simulation about a loop.
// docs/reference/configuration.md lists all keys.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::config {

Loaded<plant::LoopModel> read_model_file(const std::filesystem::path& path);
// `file` is the name in diagnostics.
Loaded<plant::LoopModel> read_model_text(const std::string& file, std::string_view text);

KeyReference describe_model();

}  // namespace loopwarden::config
