// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/contract/loop_source.hpp"
#include "hal/modbus/joint_ticks.hpp"
#include "hal/modbus/modbus_bus.hpp"
#include "hal/modbus/modbus_settings.hpp"
#include "hal/modbus/read_link.hpp"

namespace loopwarden::hal::modbus {

// A loop in a PLC or DCS, read over Modbus. Each value is a separate task, so that commands of
// other loops on a shared line wait for at most one read.
class ModbusSource final : public LoopSource {
 public:
  // `name` is the loop's, for events. `bus` must outlive this object.
  ModbusSource(ModbusSourceSettings settings, const std::string& name, ModbusBus& bus);
  ~ModbusSource() override;

  void open() override;
  void close() noexcept override;
  void read(SourceInputs& inputs) noexcept override;

  IoCounters counters() const noexcept override;
  bool has_thread() const noexcept override { return true; }
  std::uint64_t ticks() const noexcept override;

 private:
  struct Point {
    Point(const SourcePoint& wired, const std::string& name, std::int64_t period_ns)
        : settings(wired), task(name, wired.point, period_ns) {}
    SourcePoint settings;
    ReadTask task;
    std::optional<ReadLink> link{};  // while open
  };
  Point& add(const SourcePoint& wired, const std::string& name);

  const ModbusSourceSettings settings_;
  ModbusBus& bus_;
  std::vector<std::unique_ptr<Point>> points_;
  Point* process_variable_;
  Point* output_;
  Point* set_point_ = nullptr;  // as below, null if not fitted
  Point* stem_ = nullptr;
  Point* mode_ = nullptr;
  JointTicks ticks_;  // of all bus threads
};

}  // namespace loopwarden::hal::modbus
