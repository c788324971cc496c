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

// What was read, after its warnings are printed; throws CommandError with all that is wrong.
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

// Throws CommandError.
plant::LoopModel load_model(const std::string& path);

// The file as it is, for reports; empty where it can't be read.
std::string text_of(const std::string& path);

// In one line: kind where it integrates, gain, lags, dead time.
std::string process_text(const plant::ProcessParameters& process);

}  // namespace loopwarden::workbench
