// SPDX-License-Identifier: Apache-2.0
#include "fleet/sparkplug/alias_table.hpp"

#include <fmt/format.h>

#include <utility>

namespace loopwarden::sparkplug {

void AliasTable::take_birth(const std::string& device, const std::vector<Metric>& metrics) {
  if (device.empty()) {
    clear();
  } else {
    remove(device);
  }
  try {
    for (const Metric& metric : metrics) add(device, metric);
  } catch (const BadPayload&) {
    remove(device);
    throw;
  }
}

void AliasTable::add(const std::string& device, const Metric& metric) {
  if (metric.name.empty()) throw BadPayload("a birth with a metric that has no name");
  if (metric.type == DataType::unknown) {
    throw BadPayload(fmt::format("a birth that gives '{}' no type", metric.name));
  }
  if (metric.alias && aliases_.contains(*metric.alias)) {
    throw BadPayload(fmt::format("alias {} of '{}' is in use", *metric.alias, metric.name));
  }
  const auto [place, added] = devices_[device].try_emplace(
      metric.name, Named{{device, metric.name, metric.type}, metric.alias});
  if (!added) throw BadPayload(fmt::format("a birth with '{}' twice", metric.name));
  if (metric.alias) aliases_.emplace(*metric.alias, &place->second.entry);
}

void AliasTable::remove(const std::string& device) {
  const auto found = devices_.find(device);
  if (found == devices_.end()) return;
  for (const auto& [name, named] : found->second) {
    if (named.alias) aliases_.erase(*named.alias);
  }
  devices_.erase(found);
}

void AliasTable::clear() {
  aliases_.clear();
  devices_.clear();
}

const AliasTable::Entry* AliasTable::find(std::uint64_t alias) const noexcept {
  const auto found = aliases_.find(alias);
  return found == aliases_.end() ? nullptr : found->second;
}

const AliasTable::Entry* AliasTable::find(const std::string& device,
                                          const std::string& name) const noexcept {
  const auto metrics = devices_.find(device);
  if (metrics == devices_.end()) return nullptr;
  const auto found = metrics->second.find(name);
  return found == metrics->second.end() ? nullptr : &found->second.entry;
}

bool AliasTable::resolve(const std::string& device, std::vector<Metric>& metrics) const {
  for (Metric& metric : metrics) {
    const bool by_alias = metric.name.empty() && metric.alias;
    const Entry* entry = by_alias ? find(*metric.alias) : find(device, metric.name);
    if (entry == nullptr || entry->device != device) return false;
    metric.name = entry->name;
    metric.type = entry->type;
    metric.value = retyped(std::move(metric.value), entry->type);
  }
  return true;
}

}  // namespace loopwarden::sparkplug
