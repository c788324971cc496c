// SPDX-License-Identifier: Apache-2.0
// What the Sparkplug B edge nodes of a group have, by their births, as a list of tags. Pure.
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

  // What is no birth tells only that its edge node is there. Throws sparkplug::BadPayload.
  void take(const sparkplug::Topic& topic, std::string_view payload);

  // Edge nodes that have spoken, and were not born since.
  std::vector<EdgeName> unborn() const;
  std::size_t metrics() const noexcept { return metrics_.size(); }
  // CSV: name (EDGE/DEVICE/METRIC), node_id (GROUP/EDGE/DEVICE/METRIC), data_type, unit, low, high, description. The last
  // four by the properties engUnit, engLow, engHigh and documentation. Metrics of the edge node's own, such as bdSeq, are
  // left out.
  std::string csv() const;

 private:
  using Key = std::tuple<std::string, std::string, std::string, std::string>;
  std::map<Key, sparkplug::Metric> metrics_;  // group, edge, device, metric
  std::set<EdgeName> spoken_;
  std::set<EdgeName> born_;
};

}  // namespace loopwarden::feed
