// SPDX-License-Identifier: Apache-2.0
// What births say of the metrics of one edge node: which alias stands for which name, of which device and type.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "fleet/sparkplug/payload.hpp"

namespace loopwarden::sparkplug {

class AliasTable {
 public:
  struct Entry {
    std::string device;  // empty: of the edge node itself
    std::string name;
    DataType type = DataType::unknown;
  };

  // A birth of `device` (empty: of the node, which takes all devices away) in place of what was known of it. Throws
  // BadPayload where a metric has no name or no type, a name stands twice, or an alias is in use by another metric of
  // the edge node; of the device nothing is known then.
  void take_birth(const std::string& device, const std::vector<Metric>& metrics);
  void remove(const std::string& device);
  void clear();

  // Null: no birth gave it.
  const Entry* find(std::uint64_t alias) const noexcept;
  const Entry* find(const std::string& device, const std::string& name) const noexcept;

  // Gives a message's metrics the name and type of the device's birth. False where one is unknown there: whoever sent
  // the message counts on a birth that was missed.
  bool resolve(const std::string& device, std::vector<Metric>& metrics) const;

 private:
  struct Named {
    Entry entry;
    std::optional<std::uint64_t> alias;
  };
  void add(const std::string& device, const Metric& metric);

  std::map<std::string, std::map<std::string, Named>> devices_;
  std::unordered_map<std::uint64_t, const Entry*> aliases_;
};

}  // namespace loopwarden::sparkplug
