// SPDX-License-Identifier: Apache-2.0
// Lists the metrics of a group's Sparkplug B edge nodes as tags, from their births. Pure.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "services/net/sparkplug/payload.hpp"
#include "services/net/sparkplug/topic.hpp"

namespace loopwarden::feed {

class BirthList {
 public:
  using EdgeName = std::pair<std::string, std::string>;  // group, edge

  // A message that is not a birth only shows that its edge node exists. Throws
  // sparkplug::BadPayload.
  void take(const sparkplug::Topic& topic, std::string_view payload);

  // Returns the edge nodes that have sent messages, but no birth since.
  std::vector<EdgeName> unborn() const;
  std::size_t metrics() const noexcept { return metrics_.size(); }
  // Returns CSV: name (EDGE/DEVICE/METRIC), node_id (GROUP/EDGE/DEVICE/METRIC), data_type, unit,
  // low, high, description. The last four are the properties engUnit, engLow, engHigh and
  // documentation. The edge node's own metrics, such as bdSeq, are left out.
  std::string csv() const;

 private:
  using Key = std::tuple<std::string, std::string, std::string, std::string>;
  std::map<Key, sparkplug::Metric> metrics_;  // group, edge, device, metric
  std::set<EdgeName> spoken_;
  std::set<EdgeName> born_;
};

}  // namespace loopwarden::feed
