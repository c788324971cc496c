// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/console/daemon_info.hpp"
#include "daemon/console/plant.hpp"
#include "daemon/gateway/loops_view.hpp"

namespace loopwarden::daemon::console {

// Reads the loops and the box for the register map. One object per thread.
class PlantReadings final : public gateway::PlantView {
 public:
  PlantReadings(const Plant& plant, const DaemonInfo& info) : plant_(plant), info_(info) {}

  std::size_t loops() const override { return plant_.loops.size(); }
  const std::string& name(std::size_t loop) const override {
    return plant_.loops[loop].config.name;
  }
  // A loop out of service takes no commands either.
  bool controlled_elsewhere(std::size_t loop) const override {
    return plant_.loops[loop].watched() ||
           config::out_of_service(plant_.loops[loop].config.io) != nullptr;
  }
  bool read_only(std::size_t loop) const override {
    return controlled_elsewhere(loop) || plant_.loops[loop].commissioning->holder().has_value();
  }
  gateway::LoopReading read(std::size_t loop) override;
  gateway::BoxReading box() override { return info_.box(); }

 private:
  Plant plant_;
  const DaemonInfo& info_;
};

}  // namespace loopwarden::daemon::console
