// SPDX-License-Identifier: Apache-2.0
// What the API asks of the plant's database.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

namespace loopwarden::fleet {

// The database does not answer, in its words.
class FleetDown : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ValveName {
  std::string group;
  std::string edge;
  std::string device;
};

// Answers are JSON, made once for all who ask within some seconds.
class Fleet {
 public:
  virtual ~Fleet() = default;
  // Of one group, or of all (empty). Throws FleetDown.
  virtual std::shared_ptr<const std::string> overview(const std::string& group) = 0;
  // The newest answer that overview() has given, however old; null: none.
  virtual std::shared_ptr<const std::string> last_overview(const std::string& group) = 0;
  // Null: there is no such valve. Throws FleetDown.
  virtual std::shared_ptr<const std::string> valve(const ValveName& name) = 0;
};

}  // namespace loopwarden::fleet
