// SPDX-License-Identifier: Apache-2.0
// One edge node as a host application sees it: which births count, whether a message is missing, what its metrics are
// called. Fed with every message of the node in the order in which they came.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "fleet/sparkplug/alias_table.hpp"
#include "fleet/sparkplug/payload.hpp"
#include "fleet/sparkplug/topic.hpp"

namespace loopwarden::sparkplug {

struct Verdict {
  // The metrics have the names and types of the birth and can be used. An old death or a message that counts on a
  // birth that was missed can not.
  bool usable = false;
  // Something is missing: the node is to be asked for a rebirth (Node Control/Rebirth).
  bool ask_rebirth = false;
  const char* why = "";  // of what is not usable or was missed
};

class NodeView {
 public:
  // Names and types the payload's metrics (of data by the birth). Commands are not for hosts and not usable. Throws
  // BadPayload for a birth that contradicts itself: as good as none, ask for another.
  Verdict take(const Topic& topic, Payload& payload);

  bool online() const noexcept { return online_; }
  bool online(const std::string& device) const { return devices_.contains(device); }
  const std::set<std::string>& devices() const noexcept { return devices_; }  // those online
  // Of the newest NBIRTH; nothing before the first.
  std::optional<std::uint64_t> bd_seq() const noexcept { return bd_seq_; }
  const AliasTable& aliases() const noexcept { return aliases_; }

 private:
  Verdict node_birth(const Payload& payload);
  Verdict node_death(const Payload& payload);
  Verdict in_sequence(const Topic& topic, Payload& payload);
  Verdict of_online_node(const Topic& topic, Payload& payload);
  void go_offline() noexcept;

  bool online_ = false;
  std::uint8_t expected_seq_ = 0;
  std::optional<std::uint64_t> bd_seq_;
  std::set<std::string> devices_;
  AliasTable aliases_;
};

}  // namespace loopwarden::sparkplug
