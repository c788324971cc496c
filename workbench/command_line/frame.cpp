// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/frame.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/parallel.hpp"
#include "workbench/command_line/background.hpp"

namespace loopwarden::workbench {

void show_json(const nlohmann::json& result) { fmt::print("{}\n", result.dump(2)); }

void show_answer(nlohmann::json answer) {
  answer["ok"] = true;
  show_json(answer);
}

unsigned threads(unsigned jobs) {
  if (in_background()) return 1;
  return jobs > 0 ? jobs : std::max(1U, std::thread::hardware_concurrency());
}

ParallelFor on_threads(unsigned count) {
  return [count](std::size_t number, const std::function<void(std::size_t)>& body) {
    base::parallel_for(number, count, body);
  };
}

}  // namespace loopwarden::workbench
