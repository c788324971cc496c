// SPDX-License-Identifier: Apache-2.0
// The io section of a loop file: one backend and its wiring.
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

// Where the file says through which link a device is reached.
struct LinkUse {
  std::string key;
  Place place;
  std::string link;
  std::uint8_t unit = 0;
};

// What the io section must fit to.
struct IoContext {
  std::string file;                               // of the loop
  Value<double> sample_time;                      // s
  Value<double> max_age;                          // s, of PV
  Value<std::pair<double, double>> pv_range;      // PV units
  Value<std::pair<double, double>> output_range;  // CO units
  const std::map<std::string, hal::modbus::LinkSettings>* links = nullptr;
  const std::map<std::string, FeederUser>* feeders = nullptr;
  std::vector<LinkUse>* link_uses = nullptr;  // where those of the section are added
};

struct IoSection {
  Io io;
  bool known = false;              // the backend was named
  bool has_read_back = false;      // of the valve position
  double output_resolution = 0.0;  // CO units
  Place command;                   // where the output's register or channel is stated
  bool output_known = false;       // what leads to the output has no error
  Place record;                    // of a replay: where its file is stated
};

IoSection read_io(MapReader& in, const IoContext& context);

// --- shared by the hardware backends ---

// poll_period, s: by default sample_time, as far as it lies within `range`.
Value<double> read_poll_period(MapReader& in, const IoContext& context, const Interval& range);

// max_command_age, ns, if it is given.
std::optional<std::int64_t> read_max_command_age(MapReader& in, const IoContext& context);

std::int64_t nanoseconds(double seconds) noexcept;

struct CommLoss {
  bool device_acts = false;
  Value<double> timeout;  // s
};

// `comm_loss`, which has no default: a word or a mapping with a timeout. `read_register` reads the
// keys of a watchdog that is written from here, where the backend has such.
CommLoss read_comm_loss(MapReader& in, const char* value_text,
                        const std::function<void(MapReader&)>& read_register);

}  // namespace loopwarden::config
