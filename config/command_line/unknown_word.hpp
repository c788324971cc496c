// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace loopwarden::config {

// What is wrong with the first word that no command or option answers to, with the nearest that one does; empty if
// all are known. Asked first: CLI11 would rather name what is missing.
std::string unknown_word(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace loopwarden::config
