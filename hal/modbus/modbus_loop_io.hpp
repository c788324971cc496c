// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "hal/contract/loop_io.hpp"
#include "hal/modbus/joint_ticks.hpp"
#include "hal/modbus/link_task.hpp"
#include "hal/modbus/modbus_bus.hpp"
#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::hal::modbus {

// A loop whose transmitter and positioner are Modbus devices. The loop's thread only accesses
// NewestValue buffers; the bus threads do the communication.
class ModbusLoopIo final : public LoopIo {
 public:
  // `name` is the loop's, for events. `bus` must outlive this object.
  ModbusLoopIo(LoopModbusSettings settings, const std::string& name, ModbusBus& bus);
  ~ModbusLoopIo() override;

  void open() override;
  void close() noexcept override;
  bool drive(double output, std::chrono::milliseconds timeout, std::string& why) override;

  void read(const CycleTime& time, Inputs& inputs) noexcept override;
  double write(const CycleTime& time, const Command& command) noexcept override;

  IoCounters counters() const noexcept override;
  bool has_thread() const noexcept override { return true; }
  std::uint64_t ticks() const noexcept override;

 private:
  // Returns the CO that the positioner makes of `output`, CO units.
  double output_stage(double output) const noexcept;
  void publish(double value, std::int64_t time_ns, bool write) noexcept;

  const LoopModbusSettings settings_;
  ModbusBus& bus_;
  LinkTask transmitter_;
  LinkTask positioner_;
  ReadPoint* process_variable_ = nullptr;  // owned by transmitter_
  ReadPoint* read_back_ = nullptr;         // owned by positioner_; null if not fitted
  std::shared_ptr<ModbusLink> transmitter_link_;
  std::shared_ptr<ModbusLink> positioner_link_;

  // Thread that runs the loop only.
  double last_output_ = 0.0;
  bool writes_ = false;               // the newest command must be written
  std::int64_t writes_since_ns_ = 0;  // time of the first such command without a break
  std::uint64_t command_id_ = 0;
  std::uint64_t lost_id_ = 0;  // of the newest command when the output was last overdue

  JointTicks ticks_;  // of both bus threads
};

}  // namespace loopwarden::hal::modbus
