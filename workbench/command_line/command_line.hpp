// SPDX-License-Identifier: Apache-2.0
// Options and rules that all commands share.
#pragma once

#include <CLI/CLI.hpp>

#include <string>

#include "workbench/files/installed_files.hpp"

namespace loopwarden::workbench {

// Adds --json with the help text that all commands use.
CLI::Option* add_json_flag(CLI::App& sub, bool& json);

// Makes each option that names a record, a model, specialists or a configuration also search the
// installed package (see installed()).
void look_in_package(CLI::App& app, const std::string& share = kShare);

// Rejects negative counts: CLI11 reads -1 as 18446744073709551615.
void refuse_negative_counts(CLI::App& app);

}  // namespace loopwarden::workbench
