// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace loopwarden::config {

// Returns an error text for the first word that no command or option accepts, with the nearest
// accepted word; empty if all are known. Called before CLI11 parses, because CLI11 would report
// missing words first.
std::string unknown_word(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace loopwarden::config
