// SPDX-License-Identifier: Apache-2.0
// The part of the plant's database that a page needs, with the test's own data.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "services/page/fleet/fleet.hpp"

namespace loopwarden::tests {

class FakeFleet final : public fleet::Fleet {
 public:
  std::shared_ptr<const std::string> overview(const std::string& group) override {
    asked.push_back(group);
    if (!why_down.empty()) throw fleet::FleetDown(why_down);
    const nlohmann::json answer{{"group", group}};
    return last = std::make_shared<const std::string>(
               answer.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  std::shared_ptr<const std::string> last_overview(const std::string&) override { return last; }
  std::shared_ptr<const std::string> valve(const fleet::ValveName& name) override {
    asked.push_back(name.group + '|' + name.edge + '|' + name.device);
    if (!why_down.empty()) throw fleet::FleetDown(why_down);
    return name.device == "none" ? nullptr : std::make_shared<const std::string>("{}");
  }

  std::string why_down;
  std::vector<std::string> asked;
  std::shared_ptr<const std::string> last;
};

}  // namespace loopwarden::tests
