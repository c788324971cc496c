// SPDX-License-Identifier: Apache-2.0
#include "workbench/files/model_file.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "base/file.hpp"
#include "config/loop_model_reader.hpp"

namespace loopwarden::workbench {

std::optional<plant::LoopModel> load_model(const std::string& path) {
  auto model = config::read_model_file(path);
  fmt::print(stderr, "{}", config::to_text(model.diagnostics));
  return std::move(model.value);
}

std::string text_of(const std::string& path) { return base::read_file(path).value_or(""); }

std::string process_text(const plant::ProcessParameters& process) {
  std::string text =
      process.integrating()
          ? fmt::format("integrating, gain {:g} PV units/(CO unit s)", process.gain)
          : fmt::format("gain {:g}, time constant {:g} s", process.gain, process.time_constant_s);
  if (process.second_time_constant_s > 0.0) {
    text += fmt::format(", second lag {:g} s", process.second_time_constant_s);
  }
  return text + fmt::format(", dead time {:g} s", process.dead_time_s);
}

}  // namespace loopwarden::workbench
