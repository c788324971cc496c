// SPDX-License-Identifier: Apache-2.0
// Reads the io section of a loop file: one backend and its wiring.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/loop_config.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::config {

// Place in the file that names the link to a device.
struct LinkUse {
  std::string key;
  Place place;
  std::string link;
  std::uint8_t unit = 0;
};

// The other keys of the loop that the io section must fit to.
struct IoContext {
  std::string file;                               // of the loop
  Value<double> sample_time;                      // s
  Value<double> max_age;                          // s, of PV
  Value<std::pair<double, double>> pv_range;      // PV units
  Value<std::pair<double, double>> output_range;  // CO units
  const std::map<std::string, hal::modbus::LinkSettings>* links = nullptr;
  const std::map<std::string, FeederUser>* feeders = nullptr;
  std::vector<LinkUse>* link_uses = nullptr;  // list to which the section's uses are added
};

struct IoSection {
  Io io;
  bool known = false;              // the backend was named
  bool has_read_back = false;      // of the valve position
  double output_resolution = 0.0;  // CO units
  Place command;                   // place of the output's register or channel
  bool output_known = false;       // the keys that locate the output have no error
  Place record;                    // of a replay: place of its file's name
};

IoSection read_io(MapReader& in, const IoContext& context);

// --- shared by the hardware backends ---

// Reads poll_period, s. Default: sample_time, limited to `range`.
Value<double> read_poll_period(MapReader& in, const IoContext& context, const Interval& range);

// Reads max_command_age, ns, if present.
std::optional<std::int64_t> read_max_command_age(MapReader& in, const IoContext& context);

std::int64_t nanoseconds(double seconds) noexcept;

struct CommLoss {
  bool device_acts = false;
  Value<double> timeout;  // s
};

// Reads `comm_loss`, which has no default: a word, or a mapping with a timeout. `read_register`
// reads the keys of a watchdog register that the backend writes, if the backend supports one.
CommLoss read_comm_loss(MapReader& in, const char* value_text,
                        const std::function<void(MapReader&)>& read_register);

}  // namespace loopwarden::config
