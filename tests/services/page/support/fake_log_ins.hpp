// SPDX-License-Identifier: Apache-2.0
// A directory with answers set by the test.
#pragma once

#include <future>
#include <string>
#include <vector>

#include "services/page/ldap/log_ins.hpp"

namespace loopwarden::tests {

class FakeLogIns final : public page::ldap::LogIns {
 public:
  std::shared_future<page::ldap::Outcome> begin(const std::string& name,
                                                const std::string& password,
                                                const std::string& whose,
                                                page::Moment until) override {
    asked.push_back(name + "|" + password + "|" + whose);
    waits_until = until;
    if (full) return {};
    answer = {};
    if (!silent) answer.set_value(says);
    return answer.get_future().share();
  }

  page::ldap::Outcome says{
      .end = page::ldap::Outcome::End::wrong, .role = page::Role::none, .dn = {}, .why = "x"};
  bool full = false;
  bool silent = false;  // until the test sets `answer`
  std::promise<page::ldap::Outcome> answer;
  std::vector<std::string> asked;
  page::Moment waits_until;  // of the newest request
};

}  // namespace loopwarden::tests
