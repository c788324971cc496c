// SPDX-License-Identifier: Apache-2.0
#include "workbench/files/model_file.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "config/loop_model_reader.hpp"

namespace loopwarden::workbench {

std::optional<plant::LoopModel> load_model(const std::string& path) {
  auto model = config::read_model_file(path);
  fmt::print(stderr, "{}", config::to_text(model.diagnostics));
  return std::move(model.value);
}

}  // namespace loopwarden::workbench
