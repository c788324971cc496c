// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/device_book.hpp"

namespace loopwarden::fleet {
namespace {

using sparkplug::Metric;
using sparkplug::number_of;

std::optional<double> birth_number(const Metric& metric, const char* key) noexcept {
  const sparkplug::Property* property = metric.property(key);
  return property == nullptr ? std::nullopt : number_of(property->value);
}

std::string birth_text(const Metric& metric, const char* key) {
  const sparkplug::Property* property = metric.property(key);
  const auto* text = property == nullptr ? nullptr : std::get_if<std::string>(&property->value);
  return text == nullptr ? std::string() : *text;
}

// Returns the unit. The specification defines no property for it; clients use either of these two
// names.
std::string unit_of(const Metric& metric) {
  std::string unit = birth_text(metric, "engUnit");
  return unit.empty() ? birth_text(metric, "unit") : unit;
}

}  // namespace

const MetricInfo* DeviceBook::find(const Metric& metric) const noexcept {
  if (!metric.name.empty()) {
    const auto found = by_name.find(metric.name);
    return found == by_name.end() ? nullptr : &metrics[found->second];
  }
  if (!metric.alias) return nullptr;
  const auto found = by_alias.find(*metric.alias);
  return found == by_alias.end() ? nullptr : &metrics[found->second];
}

std::shared_ptr<DeviceBook> book_of(const std::string& device, const std::vector<Metric>& metrics) {
  auto book = std::make_shared<DeviceBook>();
  book->device = device;
  book->tag = device;
  for (const Metric& metric : metrics) {
    if (metric.name.empty() || metric.type == sparkplug::DataType::unknown) continue;
    const std::size_t place = book->metrics.size();
    if (metric.alias && !book->by_alias.try_emplace(*metric.alias, place).second) continue;
    if (!book->by_name.try_emplace(metric.name, place).second) continue;
    book->metrics.push_back({.name = metric.name,
                             .type = metric.type,
                             .alias = metric.alias,
                             .unit = unit_of(metric),
                             .low = birth_number(metric, "engLow"),
                             .high = birth_number(metric, "engHigh")});
    const auto* text = std::get_if<std::string>(&metric.value);
    if (metric.name == "tag" && text != nullptr && !text->empty()) book->tag = *text;
  }
  return book;
}

}  // namespace loopwarden::fleet
