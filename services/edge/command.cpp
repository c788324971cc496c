// SPDX-License-Identifier: Apache-2.0
#include "services/edge/command.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string_view>

namespace loopwarden::edge {
namespace {

using nlohmann::json;
using sparkplug::Metric;
using sparkplug::Value;

std::optional<double> number_of(const Value& value) {
  if (const auto* d = std::get_if<double>(&value))
    return std::isfinite(*d) ? std::optional(*d) : std::nullopt;
  if (const auto* i = std::get_if<std::int64_t>(&value)) return static_cast<double>(*i);
  if (const auto* u = std::get_if<std::uint64_t>(&value)) return static_cast<double>(*u);
  return std::nullopt;
}

bool is_true(const Value& value) {
  const auto* flag = std::get_if<bool>(&value);
  return flag != nullptr && *flag;
}

// Text behind `prefix`; nothing where the name has another.
std::optional<std::string> behind(std::string_view prefix, const std::string& name) {
  if (!name.starts_with(prefix)) return std::nullopt;
  return name.substr(prefix.size());
}

// What may stand together in one `set`. False: the metric is none of them, or has no value for it.
bool add_to_set(const Metric& metric, Order& set) {
  const std::optional<double> value = number_of(metric.value);
  if (!value) return false;
  if (metric.name == "mode") {
    if (*value != 0.0 && *value != 1.0) return false;
    set.request["mode"] = *value == 1.0 ? "auto" : "man";
  } else if (metric.name == "sp") {
    set.request["set_point"] = *value;
  } else if (metric.name == "output") {
    set.request["output"] = *value;
  } else {
    return false;
  }
  set.what += fmt::format("{}{} {}", set.what.empty() ? "" : ", ", metric.name, *value);
  return true;
}

std::optional<Order> shelve_order(const Metric& metric) {
  const auto alarm = behind("shelve_", metric.name);
  const std::optional<double> minutes = number_of(metric.value);
  if (!alarm || !minutes || *minutes < 0.0 || *minutes != std::floor(*minutes)) return std::nullopt;
  json request{{"request", "alarm"}, {"alarm", *alarm}};
  if (*minutes == 0.0) {
    request["action"] = "unshelve";
  } else {
    request["action"] = "shelve";
    request["minutes"] = static_cast<std::uint64_t>(*minutes);
  }
  return Order{fmt::format("{} {}", metric.name, *minutes), std::move(request)};
}

std::optional<Order> alarm_order(const Metric& metric) {
  for (const char* action : {"acknowledge", "reset", "unshelve"}) {
    const auto alarm = behind(std::string(action) + '_', metric.name);
    if (alarm && is_true(metric.value)) {
      return Order{metric.name, {{"request", "alarm"}, {"alarm", *alarm}, {"action", action}}};
    }
  }
  const auto* flag = std::get_if<bool>(&metric.value);
  if (metric.name == "veto_corrective_action" && flag != nullptr) {
    return Order{fmt::format("veto {}", *flag), {{"request", "veto"}, {"veto", *flag}}};
  }
  return shelve_order(metric);
}

void read_node_metric(const Metric& metric, Command& command) {
  if (metric.name == "Node Control/Rebirth") {
    command.rebirth = command.rebirth || is_true(metric.value);
  } else if (metric.name == "acknowledge_all") {
    command.acknowledge_all = command.acknowledge_all || is_true(metric.value);
  } else {
    command.refused.push_back(fmt::format("{} is no order", metric.name));
  }
}

void read_device_metric(const Metric& metric, Order& set, Command& command) {
  if (add_to_set(metric, set)) return;
  if (const auto* text = std::get_if<std::string>(&metric.value);
      text != nullptr && metric.name == "request/evidence") {
    command.evidence.push_back(*text);
  } else if (std::optional<Order> order = alarm_order(metric)) {
    command.orders.push_back(std::move(*order));
  } else {
    command.refused.push_back(fmt::format("{} is no order, or has no value for one", metric.name));
  }
}

}  // namespace

Command read_command(const std::vector<Metric>& metrics, bool of_device) {
  Command command;
  Order set{"", {{"request", "set"}}};
  for (const Metric& metric : metrics) {
    if (of_device) {
      read_device_metric(metric, set, command);
    } else {
      read_node_metric(metric, command);
    }
  }
  if (!set.what.empty()) command.orders.insert(command.orders.begin(), std::move(set));
  return command;
}

}  // namespace loopwarden::edge
