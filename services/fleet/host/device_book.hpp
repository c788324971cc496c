// SPDX-License-Identifier: Apache-2.0
// What a birth said of a device's metrics, and the numbers that the database has given them.
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
  std::string unit{};  // empty: none was given
  std::optional<double> low{};
  std::optional<double> high{};
  int id = 0;  // in table metric
};

struct DeviceBook {
  std::string device;  // empty: the box itself
  std::string tag;
  int edge_id = 0;
  int device_id = 0;
  std::vector<MetricInfo> metrics;
  std::unordered_map<std::string, std::size_t> by_name;
  std::unordered_map<std::uint64_t, std::size_t> by_alias;

  // The metric that a message's metric is, by its name or else its alias; null: no birth gave it.
  const MetricInfo* find(const sparkplug::Metric& metric) const noexcept;
};

// Of a birth's metrics. A metric without name or type, and one whose name or alias stands twice, is left out: it can't
// be told what later values belong to.
std::shared_ptr<DeviceBook> book_of(const std::string& device,
                                    const std::vector<sparkplug::Metric>& metrics);

}  // namespace loopwarden::fleet
