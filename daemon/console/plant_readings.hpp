// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/console/parts.hpp"
#include "daemon/gateway/loops_view.hpp"

namespace loopwarden::daemon::console {

// The loops and the box as the register map sees them. Any thread, one object each.
class PlantReadings final : public gateway::PlantView {
 public:
  explicit PlantReadings(const Parts& parts) : parts_(parts) {}

  std::size_t loops() const override { return parts_.loops.size(); }
  const std::string& name(std::size_t loop) const override {
    return parts_.loops[loop].config.name;
  }
  // Nor can anything be ordered of a loop that is out of service.
  bool controlled_elsewhere(std::size_t loop) const override {
    return parts_.loops[loop].watched() ||
           config::out_of_service(parts_.loops[loop].config.io) != nullptr;
  }
  bool read_only(std::size_t loop) const override {
    return controlled_elsewhere(loop) || parts_.loops[loop].commissioning->holder().has_value();
  }
  gateway::LoopReading read(std::size_t loop) override;
  gateway::BoxReading box() override { return parts_.box(); }

 private:
  const Parts& parts_;
};

}  // namespace loopwarden::daemon::console
