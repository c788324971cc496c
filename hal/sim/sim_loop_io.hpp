// SPDX-License-Identifier: Apache-2.0
// A backend with a simulated plant: the composed loop of model/plant, one sample per control
// period.
//
// The plant advances in read(), on the real-time thread, by one sample per elapsed period. An
// overrun therefore has the same effect as on a real loop.
#pragma once

#include <atomic>
#include <vector>

#include "hal/contract/loop_io.hpp"
#include "base/newest_value.hpp"
#include "hal/sim/sim_settings.hpp"
#include "model/plant/plant.hpp"

namespace loopwarden::hal::sim {

// Values of the simulation that a real transmitter can't measure.
struct GroundTruth {
  double time_s = 0.0;            // simulated time
  double stem = 0.0;              // CO units
  double process_variable = 0.0;  // PV units, before the transmitter
  double fault_severity = 0.0;    // of the scheduled faults, 0 to 1
};

class SimLoopIo final : public LoopIo {
 public:
  explicit SimLoopIo(const SimSettings& settings);

  void open() override {}
  void close() noexcept override {}
  bool drive(double output, std::chrono::milliseconds timeout, std::string& why) override;
  void read(const CycleTime& time, Inputs& inputs) noexcept override;
  double write(const CycleTime& time, const Command& command) noexcept override;
  IoCounters counters() const noexcept override;

  // One reading thread only.
  GroundTruth truth() noexcept { return truth_.newest(); }

 private:
  bool active(IoFault::Kind kind) const noexcept;

  plant::Plant plant_;
  plant::TransmitterParameters transmitter_;
  std::vector<IoFault> io_faults_;
  double output_low_;         // CO units
  double output_high_;        // CO units
  double output_resolution_;  // CO units
  double held_output_;        // CO units, present input of the plant
  bool first_read_ = true;
  std::uint64_t last_period_ = 0;
  Sample pv_;
  Sample stem_;
  base::NewestValue<GroundTruth> truth_;
  std::atomic<std::uint64_t> writes_{0};
};

}  // namespace loopwarden::hal::sim
