// SPDX-License-Identifier: Apache-2.0
// `loopwarden-page ldap-test`.
#pragma once

#include <CLI/CLI.hpp>

namespace loopwarden::page {

// Writes the command's exit code to `exit_code`.
void add_ldap_command(CLI::App& app, int& exit_code);

}  // namespace loopwarden::page
