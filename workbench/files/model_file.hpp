// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

#include "config/diagnostic.hpp"
#include "model/plant/loop_model.hpp"
#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench {

// Returns the loaded value and prints its warnings. Throws CommandError that lists all errors.
template <class T>
T usable(config::Loaded<T> loaded) {
  std::string text = config::to_text(loaded.diagnostics);
  if (loaded) {
    fmt::print(stderr, "{}", text);
    return std::move(*loaded);
  }
  if (text.ends_with('\n')) text.pop_back();
  throw CommandError(kExitConfiguration, text);
}

// Loads a model file. Throws CommandError.
plant::LoopModel load_model(const std::string& path);

// Returns the text of a file for reports, or an empty text if the file is not readable.
std::string text_of(const std::string& path);

// Returns the process in one line: its kind if it integrates, gain, lags, dead time.
std::string process_text(const plant::ProcessParameters& process);

}  // namespace loopwarden::workbench
