// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <set>
#include <string>
#include <utility>

namespace loopwarden::page::api {

// Names of this box in a browser's address line, in lower case; addresses are always accepted. Any
// thread: a new certificate changes the names.
class HostNames {
 public:
  explicit HostNames(std::set<std::string> names) { replace(std::move(names)); }

  bool has(const std::string& name) const {
    const std::lock_guard lock(mutex_);
    return names_.contains(name);
  }
  void replace(std::set<std::string> names) {
    const std::lock_guard lock(mutex_);
    names_ = std::move(names);
  }

 private:
  mutable std::mutex mutex_;
  std::set<std::string> names_;
};

}  // namespace loopwarden::page::api
