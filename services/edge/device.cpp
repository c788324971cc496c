// SPDX-License-Identifier: Apache-2.0
#include "services/edge/device.hpp"

#include <cmath>
#include <utility>

namespace loopwarden::edge {
namespace {

using sparkplug::DataType;
using sparkplug::Metric;

constexpr std::int64_t kBad = 0;  // of Quality
constexpr std::int64_t kGood = 192;

std::vector<sparkplug::Property> properties_of(const MetricSpec& spec) {
  std::vector<sparkplug::Property> properties;
  if (!spec.unit.empty()) properties.push_back({"engUnit", DataType::string, spec.unit});
  if (spec.low) properties.push_back({"engLow", DataType::float64, *spec.low});
  if (spec.high) properties.push_back({"engHigh", DataType::float64, *spec.high});
  return properties;
}

}  // namespace

Device::Device(std::string name, std::vector<MetricSpec> specs, std::uint64_t first_alias)
    : name_(std::move(name)), specs_(std::move(specs)), first_alias_(first_alias) {
  for (std::size_t i = 0; i < specs_.size(); ++i) index_.emplace(specs_[i].name, i);
}

Metric Device::metric(std::size_t index, const Reading::Item& item, std::uint64_t time_ms) const {
  Metric metric;
  metric.name = specs_[index].name;
  metric.type = specs_[index].type;
  metric.time_ms = time_ms;
  metric.value = item.value;
  return metric;
}

std::vector<Metric> Device::birth(const Reading& now, std::uint64_t time_ms) {
  std::vector<Metric> metrics;
  metrics.reserve(specs_.size());
  for (std::size_t i = 0; i < specs_.size(); ++i) {
    Metric one = metric(i, now.items.at(i), time_ms);
    if (specs_[i].aliased) one.alias = first_alias_ + i;
    one.properties = properties_of(specs_[i]);
    if (!now.items[i].good) one.properties.push_back({"Quality", DataType::int32, kBad});
    metrics.push_back(std::move(one));
  }
  sent_ = now.items;
  slow_sent_ms_ = time_ms;
  return metrics;
}

bool Device::differs(std::size_t index, const Reading::Item& item) const {
  const Reading::Item& before = sent_[index];
  if (item == before) return false;
  const auto* now = std::get_if<double>(&item.value);
  const auto* then = std::get_if<double>(&before.value);
  if (now == nullptr || then == nullptr || item.good != before.good) return true;
  const MetricSpec& spec = specs_[index];
  const double whole = spec.low && spec.high ? *spec.high - *spec.low : std::abs(*then);
  constexpr double kRounding = 1e-9;
  return std::abs(*now - *then) > (1.0 + kRounding) * spec.dead_band_percent / 100.0 * whole;
}

std::vector<Metric> Device::changes(const Reading& now, std::uint64_t time_ms,
                                    std::chrono::milliseconds slow_interval) {
  const auto since_slow = static_cast<std::int64_t>(time_ms - slow_sent_ms_);
  // Also true if the clock was set back.
  const bool slow_due = since_slow < 0 || since_slow >= slow_interval.count();
  std::vector<Metric> metrics;
  for (std::size_t i = 0; i < specs_.size(); ++i) {
    const Reading::Item& item = now.items.at(i);
    if ((specs_[i].slow && !slow_due) || !differs(i, item)) continue;
    Metric one = metric(i, item, time_ms);
    if (item.good != sent_[i].good || !item.good) {
      one.properties.push_back({"Quality", DataType::int32, item.good ? kGood : kBad});
    }
    metrics.push_back(std::move(one));
    sent_[i] = item;
  }
  if (slow_due) slow_sent_ms_ = time_ms;
  return metrics;
}

bool Device::has(const Metric& metric) const {
  const auto found = index_.find(metric.name);
  return found != index_.end() && specs_[found->second].type == metric.type;
}

std::optional<std::uint64_t> Device::alias_of(const std::string& metric) const {
  const auto found = index_.find(metric);
  if (found == index_.end() || !specs_[found->second].aliased) return std::nullopt;
  return first_alias_ + found->second;
}

const MetricSpec* Device::meant_by(const Metric& command) const {
  if (!command.name.empty()) {
    const auto found = index_.find(command.name);
    return found == index_.end() ? nullptr : &specs_[found->second];
  }
  if (!command.alias || *command.alias < first_alias_ || *command.alias >= next_alias())
    return nullptr;
  return &specs_[*command.alias - first_alias_];
}

}  // namespace loopwarden::edge
