// SPDX-License-Identifier: Apache-2.0
#include "services/edge/command.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

namespace loopwarden::edge {
namespace {

using sparkplug::Metric;
using sparkplug::Value;

// Returns the number of a command. true and false are not numbers here.
std::optional<double> ordered(const Value& value) {
  return std::holds_alternative<bool>(value) ? std::nullopt : sparkplug::number_of(value);
}

bool is_true(const Value& value) {
  const auto* flag = std::get_if<bool>(&value);
  return flag != nullptr && *flag;
}

// Returns the text after `prefix`; nullopt if the name has another beginning.
std::optional<std::string> behind(std::string_view prefix, const std::string& name) {
  if (!name.starts_with(prefix)) return std::nullopt;
  return name.substr(prefix.size());
}

// Adds a metric that may share one `set` with others. Returns false if the metric is not one of
// these, or its value doesn't fit.
bool add_to_set(const Metric& metric, std::string& what, protocol::SetRequest& set) {
  const std::optional<double> value = ordered(metric.value);
  if (!value) return false;
  if (metric.name == "mode") {
    if (*value != 0.0 && *value != 1.0) return false;
    set.mode = *value == 1.0 ? "auto" : "man";
  } else if (metric.name == "sp") {
    set.set_point = *value;
  } else if (metric.name == "output") {
    set.output = *value;
  } else {
    return false;
  }
  what += fmt::format("{}{} {}", what.empty() ? "" : ", ", metric.name, *value);
  return true;
}

protocol::AlarmRequest on_alarm(std::string alarm, const char* action) {
  protocol::AlarmRequest request;
  request.alarm = std::move(alarm);
  request.action = action;
  return request;
}

std::optional<Order> shelve_order(const Metric& metric) {
  const auto alarm = behind("shelve_", metric.name);
  const std::optional<double> minutes = ordered(metric.value);
  if (!alarm || !minutes || *minutes < 0.0 || *minutes != std::floor(*minutes)) return std::nullopt;
  protocol::AlarmRequest request = on_alarm(*alarm, *minutes == 0.0 ? "unshelve" : "shelve");
  if (*minutes > 0.0) request.minutes = static_cast<std::uint64_t>(*minutes);
  return Order{fmt::format("{} {}", metric.name, *minutes), std::move(request)};
}

std::optional<Order> alarm_order(const Metric& metric) {
  // This is a register, not a coil, so its value is a number.
  if (metric.name == "calm_stiction" && ordered(metric.value) == 1.0) {
    return Order{metric.name, on_alarm("stiction", "calm")};
  }
  for (const char* action : {"acknowledge", "reset", "unshelve"}) {
    const auto alarm = behind(std::string(action) + '_', metric.name);
    if (alarm && is_true(metric.value)) {
      return Order{metric.name, on_alarm(*alarm, action)};
    }
  }
  const auto* flag = std::get_if<bool>(&metric.value);
  if (metric.name == "veto_corrective_action" && flag != nullptr) {
    protocol::VetoRequest request;
    request.veto = *flag;
    return Order{fmt::format("veto {}", *flag), std::move(request)};
  }
  return shelve_order(metric);
}

void read_node_metric(const Metric& metric, Command& command) {
  if (metric.name == "Node Control/Rebirth") {
    command.rebirth = command.rebirth || is_true(metric.value);
  } else if (metric.name == "acknowledge_all") {
    command.acknowledge_all = command.acknowledge_all || is_true(metric.value);
  } else {
    command.refused.push_back(fmt::format("{} is not a command", metric.name));
  }
}

void read_device_metric(const Metric& metric, Command& command) {
  if (const auto* text = std::get_if<std::string>(&metric.value);
      text != nullptr && metric.name == "request/evidence") {
    command.evidence.push_back(*text);
  } else if (std::optional<Order> order = alarm_order(metric)) {
    command.orders.push_back(std::move(*order));
  } else {
    command.refused.push_back(
        fmt::format("{} is not a command, or lacks a valid value", metric.name));
  }
}

}  // namespace

Command read_command(const std::vector<Metric>& metrics, bool of_device) {
  Command command;
  std::string what;
  protocol::SetRequest set;
  for (const Metric& metric : metrics) {
    if (!of_device) {
      read_node_metric(metric, command);
    } else if (!add_to_set(metric, what, set)) {
      read_device_metric(metric, command);
    }
  }
  if (!what.empty()) command.orders.insert(command.orders.begin(), {what, std::move(set)});
  return command;
}

}  // namespace loopwarden::edge
