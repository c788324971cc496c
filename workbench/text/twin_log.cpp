// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/twin_log.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

namespace loopwarden::workbench {

void TwinLog::add(const watch::LoopMonitor& loop, double time_s) {
  ++cycles_;
  const watch::TwinRemarks remarks = loop.remarks().value();
  if (remarks.judging == watch::Judging::here) ++judged_;
  const std::optional<watch::LoadOutside>& load = remarks.load;
  if (load && !outside_) loads_.push_back({time_s, time_s, load->size});
  outside_ = load.has_value();
  if (!load) return;
  loads_.back().to_s = time_s;
  if (std::abs(load->size) > std::abs(loads_.back().size)) loads_.back().size = load->size;
}

nlohmann::json TwinLog::json(const watch::LoopMonitor& loop) const {
  nlohmann::json loads = nlohmann::json::array();
  for (const Load& load : loads_) {
    loads.push_back({{"from_s", load.from_s}, {"to_s", load.to_s}, {"size", load.size}});
  }
  nlohmann::json untested = nlohmann::json::object();
  for (std::size_t i = 0; i < watch::kTwinChanges; ++i) {
    const auto change = static_cast<watch::TwinChange>(i);
    untested[watch::to_text(change)] = loop.twin()->untested_s(change);
  }
  const watch::ControllerWatch& controller = *loop.controller();
  if (controller.watched()) untested["controller"] = controller.untested_s();
  return {{"judged_share",
           cycles_ > 0 ? static_cast<double>(judged_) / static_cast<double>(cycles_) : 0.0},
          {"controller_not_watched",
           controller.watched() ? nlohmann::json() : nlohmann::json(controller.why_not())},
          {"load_outside", std::move(loads)},
          {"untested_s", std::move(untested)}};
}

}  // namespace loopwarden::workbench
