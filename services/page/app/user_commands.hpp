// SPDX-License-Identifier: Apache-2.0
// `loopwarden-page user` and `loopwarden-page certificate`.
#pragma once

#include <CLI/CLI.hpp>

namespace loopwarden::page {

// They write their exit code to `exit_code`, and throw std::runtime_error.
void add_user_commands(CLI::App& app, int& exit_code);
void add_certificate_command(CLI::App& app, int& exit_code);

}  // namespace loopwarden::page
