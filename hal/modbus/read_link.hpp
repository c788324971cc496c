// SPDX-License-Identifier: Apache-2.0
// What a loop that another controller runs has of a link. A ReadTask holds a point to be read and no
// command, and nothing puts one in; all that a link sends for such a task are read requests, whose
// function is a ReadFunction: 1 to 4. So nothing is ever written, also where the link is a serial line on
// which the commands of other loops go on.
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

  // The reader's thread.
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

  // Served from attach() until detach() returns. Any thread but the bus thread.
  void attach(ReadTask& task) { link_->attach(task.task_); }
  void detach(ReadTask& task) noexcept { link_->detach(task.task_); }

  std::uint64_t ticks() const noexcept { return link_->ticks(); }
  std::uint64_t reconnects() const noexcept { return link_->reconnects(); }
  bool same_as(const ReadLink& other) const noexcept { return link_ == other.link_; }

 private:
  std::shared_ptr<ModbusLink> link_;
};

}  // namespace loopwarden::hal::modbus
