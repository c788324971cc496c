// SPDX-License-Identifier: Apache-2.0
// The metrics of a device or of the edge node itself: the contents of its birth, and of its data,
// which is sent by exception. Pure.
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
  bool slow = false;               // changes all the time: sent once per interval
  bool aliased = true;             // the specification gives Node Control/Rebirth no alias
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
  // Aliases count from `first_alias`, one per metric.
  Device(std::string name, std::vector<MetricSpec> specs, std::uint64_t first_alias);

  const std::string& name() const noexcept { return name_; }
  const std::vector<MetricSpec>& specs() const noexcept { return specs_; }
  std::uint64_t next_alias() const noexcept { return first_alias_ + specs_.size(); }

  // Returns every metric with name, alias, type, properties (engUnit, engLow, engHigh) and value,
  // for a birth.
  std::vector<sparkplug::Metric> birth(const Reading& now, std::uint64_t time_ms);
  // Returns the metrics that differ from the last sent value by their dead band or more, with name
  // and type, for data. Slow metrics that changed are returned once per `slow_interval`.
  std::vector<sparkplug::Metric> changes(const Reading& now, std::uint64_t time_ms,
                                         std::chrono::milliseconds slow_interval);

  // Returns whether the device has this metric, with the same type.
  bool has(const sparkplug::Metric& metric) const;
  // Returns the alias of a metric; nullopt if the metric has no alias.
  std::optional<std::uint64_t> alias_of(const std::string& metric) const;
  // Returns the metric of a command, by name or alias; null if the device has no such metric.
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
