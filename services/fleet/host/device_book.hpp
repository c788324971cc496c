// SPDX-License-Identifier: Apache-2.0
// The metrics of a device from its birth, with their numbers in the database.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "services/net/sparkplug/payload.hpp"

namespace loopwarden::fleet {

struct MetricInfo {
  std::string name;
  sparkplug::DataType type = sparkplug::DataType::unknown;
  std::optional<std::uint64_t> alias{};
  std::string unit{};  // empty: no unit was given
  std::optional<double> low{};
  std::optional<double> high{};
  int id = 0;  // number in table metric
};

struct DeviceBook {
  std::string device;  // empty: the box itself
  std::string tag;
  int edge_id = 0;
  int device_id = 0;
  std::vector<MetricInfo> metrics;
  std::unordered_map<std::string, std::size_t> by_name;
  std::unordered_map<std::uint64_t, std::size_t> by_alias;

  // Returns the metric of a message, by its name or otherwise its alias; null: not in the birth.
  const MetricInfo* find(const sparkplug::Metric& metric) const noexcept;
};

// Makes the book of a birth's metrics. A metric without name or type is left out. Metrics that
// share a name or alias are left out too, because later values could not be assigned to them.
std::shared_ptr<DeviceBook> book_of(const std::string& device,
                                    const std::vector<sparkplug::Metric>& metrics);

}  // namespace loopwarden::fleet
