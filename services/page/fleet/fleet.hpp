// SPDX-License-Identifier: Apache-2.0
// Queries of the API on the plant's database.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "services/database/database_settings.hpp"

namespace loopwarden::fleet {

// The database does not answer. The text is the database's error.
class FleetDown : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ValveName {
  std::string group;
  std::string edge;
  std::string device;
};

// Answers queries as JSON. An answer is made once for all requests within some seconds.
class Fleet {
 public:
  virtual ~Fleet() = default;
  // Returns the overview of one group, or of all (empty). Throws FleetDown.
  virtual std::shared_ptr<const std::string> overview(const std::string& group) = 0;
  // Returns the newest answer of overview() of any age; null: no answer.
  virtual std::shared_ptr<const std::string> last_overview(const std::string& group) = 0;
  // Returns null if the valve does not exist. Throws FleetDown.
  virtual std::shared_ptr<const std::string> valve(const ValveName& name) = 0;
};

// The one function of the module of queries, and its name.
using MakeFleet = Fleet*(const DatabaseSettings&);
inline constexpr const char* kMakeFleet = "loopwarden_make_fleet";

}  // namespace loopwarden::fleet
