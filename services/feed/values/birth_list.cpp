// SPDX-License-Identifier: Apache-2.0
#include "services/feed/values/birth_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace loopwarden::feed {
namespace {

using sparkplug::MessageType;

std::string cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::string property_text(const sparkplug::Metric& metric, std::string_view key) {
  const sparkplug::Property* property = metric.property(key);
  if (property == nullptr) return {};
  if (const auto* text = std::get_if<std::string>(&property->value)) return *text;
  const auto number = sparkplug::number_of(property->value);
  return number ? fmt::format("{}", *number) : std::string();
}

bool of_the_node(const std::string& metric) {
  return metric == "bdSeq" || metric.starts_with("Node Control/") ||
         metric.starts_with("Node Info/");
}

}  // namespace

void BirthList::take(const sparkplug::Topic& topic, std::string_view payload) {
  const EdgeName edge{topic.group, topic.edge};
  spoken_.insert(edge);
  if (topic.type == MessageType::nbirth) born_.insert(edge);
  if (topic.type != MessageType::nbirth && topic.type != MessageType::dbirth) return;
  for (sparkplug::Metric& metric : sparkplug::decode(payload).metrics) {
    if (metric.name.empty() || of_the_node(metric.name)) continue;
    const Key key{topic.group, topic.edge, topic.device, metric.name};
    metrics_.insert_or_assign(key, std::move(metric));
  }
}

std::vector<BirthList::EdgeName> BirthList::unborn() const {
  std::vector<EdgeName> names;
  std::set_difference(spoken_.begin(), spoken_.end(), born_.begin(), born_.end(),
                      std::back_inserter(names));
  return names;
}

std::string BirthList::csv() const {
  std::string text = "name,node_id,data_type,unit,low,high,description\n";
  for (const auto& [key, metric] : metrics_) {
    const auto& [group, edge, device, name] = key;
    const std::string place = device.empty() ? edge : edge + "/" + device;
    text += fmt::format(
        "{},{},{},{},{},{},{}\n", cell(place + "/" + name),
        cell(group + "/" + edge + "/" + device + "/" + name), sparkplug::to_text(metric.type),
        cell(property_text(metric, "engUnit")), cell(property_text(metric, "engLow")),
        cell(property_text(metric, "engHigh")), cell(property_text(metric, "documentation")));
  }
  return text;
}

}  // namespace loopwarden::feed
