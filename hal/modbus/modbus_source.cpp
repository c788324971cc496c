// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_source.hpp"

#include <algorithm>
#include <span>
#include <utility>

namespace loopwarden::hal::modbus {

ModbusSource::ModbusSource(ModbusSourceSettings settings, const std::string& name, ModbusBus& bus)
    : settings_(std::move(settings)),
      bus_(bus),
      process_variable_(&add(settings_.process_variable, name + " pv")),
      output_(&add(settings_.output, name + " co")) {
  if (settings_.set_point) set_point_ = &add(*settings_.set_point, name + " sp");
  if (settings_.stem) stem_ = &add(*settings_.stem, name + " stem");
  if (settings_.mode) mode_ = &add(*settings_.mode, name + " mode");
}

ModbusSource::~ModbusSource() { close(); }

ModbusSource::Point& ModbusSource::add(const SourcePoint& wired, const std::string& name) {
  return *points_.emplace_back(std::make_unique<Point>(wired, name, settings_.poll_period_ns));
}

void ModbusSource::open() {
  if (process_variable_->link) return;
  // All links first: if one is refused, no task is attached.
  std::vector<ReadLink> links;
  for (const auto& point : points_) {
    links.push_back(bus_.read_link(point->settings.link, point->settings.point.unit));
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    points_[i]->link = std::move(links[i]);
    points_[i]->link->attach(points_[i]->task);
  }
}

void ModbusSource::close() noexcept {
  for (const auto& point : points_) {
    if (!point->link) continue;
    point->link->detach(point->task);
    point->link.reset();
  }
}

void ModbusSource::read(SourceInputs& inputs) noexcept {
  // Polled values are fresh by themselves: the source is alive while it answers.
  const auto newest = [](Point* point) {
    if (point == nullptr) return SourceSample{};
    const Sample& sample = point->task.newest();
    return SourceSample{.sample = sample, .alive_ns = sample.time_ns};
  };
  inputs = {.process_variable = newest(process_variable_),
            .output = newest(output_),
            .set_point = newest(set_point_),
            .stem = newest(stem_),
            .mode = newest(mode_)};
}

IoCounters ModbusSource::counters() const noexcept {
  IoCounters sum;
  sum.connected = true;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const TaskCounters& counters = points_[i]->task.counters();
    add_to(sum, counters);
    sum.connected = sum.connected && counters.connected.load(std::memory_order_relaxed);
    const std::optional<ReadLink>& link = points_[i]->link;
    const bool counted = std::any_of(
        points_.begin(), points_.begin() + static_cast<long>(i), [&](const auto& earlier) {
          return link && earlier->link && earlier->link->same_as(*link);
        });
    if (link && !counted) sum.reconnects += link->reconnects();
  }
  return sum;
}

std::uint64_t ModbusSource::ticks() const noexcept {
  if (!process_variable_->link) return 0;
  std::array<std::uint64_t, JointTicks::kMost> ticks{};
  for (std::size_t i = 0; i < points_.size(); ++i) ticks[i] = points_[i]->link->ticks();
  return ticks_.of(std::span(ticks).first(points_.size()));
}

}  // namespace loopwarden::hal::modbus
