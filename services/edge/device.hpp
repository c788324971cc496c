// SPDX-License-Identifier: Apache-2.0
// The metrics of a device, or of the edge node itself: what its birth says, and what is sent by exception. Pure.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "services/net/sparkplug/payload.hpp"

namespace loopwarden::edge {

struct MetricSpec {
  std::string name;
  sparkplug::DataType type = sparkplug::DataType::string;
  std::string unit;           // empty: a pure number
  std::optional<double> low;  // of its range, in that unit
  std::optional<double> high;
  double dead_band_percent = 0.0;  // of the range, or of the last value sent; 0: any change is sent
  bool slow = false;               // changes all the time: sent once an interval
  bool aliased = true;             // Node Control/Rebirth has none, by the specification
  friend bool operator==(const MetricSpec&, const MetricSpec&) = default;
};

// One value of each metric, in the order of the specs.
struct Reading {
  struct Item {
    sparkplug::Value value;
    bool good = true;  // false: Quality 0
    friend bool operator==(const Item&, const Item&) = default;
  };
  std::vector<Item> items;
};

class Device {
 public:
  // Aliases run from `first_alias` on, one a metric.
  Device(std::string name, std::vector<MetricSpec> specs, std::uint64_t first_alias);

  const std::string& name() const noexcept { return name_; }
  const std::vector<MetricSpec>& specs() const noexcept { return specs_; }
  std::uint64_t next_alias() const noexcept { return first_alias_ + specs_.size(); }

  // Every metric with name, alias, type, properties (engUnit, engLow, engHigh) and value, for a birth.
  std::vector<sparkplug::Metric> birth(const Reading& now, std::uint64_t time_ms);
  // Those that differ from what was sent last by their dead band, with name and type, for data. Slow ones go once
  // `slow_interval`, of those that changed.
  std::vector<sparkplug::Metric> changes(const Reading& now, std::uint64_t time_ms,
                                         std::chrono::milliseconds slow_interval);

  // Whether the metric is one of these, of the same type.
  bool has(const sparkplug::Metric& metric) const;
  // Of a metric's alias; nullopt if there is none.
  std::optional<std::uint64_t> alias_of(const std::string& metric) const;
  // The metric that a command means, by name or alias; null: none of this device.
  const MetricSpec* meant_by(const sparkplug::Metric& command) const;

 private:
  bool differs(std::size_t index, const Reading::Item& item) const;
  sparkplug::Metric metric(std::size_t index, const Reading::Item& item,
                           std::uint64_t time_ms) const;

  std::string name_;
  std::vector<MetricSpec> specs_;
  std::uint64_t first_alias_;
  std::map<std::string, std::size_t> index_;
  std::vector<Reading::Item> sent_;
  std::uint64_t slow_sent_ms_ = 0;
};

}  // namespace loopwarden::edge
