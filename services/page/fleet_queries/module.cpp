// SPDX-License-Identifier: Apache-2.0
#include "services/page/fleet/fleet.hpp"
#include "services/page/fleet_queries/fleet_database.hpp"

extern "C" loopwarden::fleet::MakeFleet loopwarden_make_fleet;

extern "C" loopwarden::fleet::Fleet* loopwarden_make_fleet(
    const loopwarden::fleet::DatabaseSettings& settings) {
  return new loopwarden::fleet::FleetDatabase(settings);
}
