// SPDX-License-Identifier: Apache-2.0
// Read-only access to a link, for a loop that another controller runs. A ReadTask has one point to
// be read and no command, and has no function to add one. A link sends only read requests for such
// a task, with a ReadFunction, 1 to 4. No value is therefore written, even if other loops write
// commands on the same serial line.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "hal/modbus/link_task.hpp"
#include "hal/modbus/modbus_link.hpp"

namespace loopwarden::hal::modbus {

class ReadTask {
 public:
  // `name`: for events.
  ReadTask(std::string name, const PointSettings& point, std::int64_t period_ns) {
    task_.name = std::move(name);
    task_.period_ns = period_ns;
    task_.yields = true;
    task_.reads.push_back(std::make_unique<ReadPoint>(point));
  }

  // Reader's thread only.
  const Sample& newest() noexcept { return task_.reads.front()->newest.newest(); }
  // Any thread.
  const TaskCounters& counters() const noexcept { return task_.counters; }

 private:
  friend class ReadLink;
  LinkTask task_;
};

class ReadLink {
 public:
  explicit ReadLink(std::shared_ptr<ModbusLink> link) : link_(std::move(link)) {}

  // The task is served from attach() until detach() returns. Any thread except the bus thread.
  void attach(ReadTask& task) { link_->attach(task.task_); }
  void detach(ReadTask& task) noexcept { link_->detach(task.task_); }

  std::uint64_t ticks() const noexcept { return link_->ticks(); }
  std::uint64_t reconnects() const noexcept { return link_->reconnects(); }
  bool same_as(const ReadLink& other) const noexcept { return link_ == other.link_; }

 private:
  std::shared_ptr<ModbusLink> link_;
};

}  // namespace loopwarden::hal::modbus
