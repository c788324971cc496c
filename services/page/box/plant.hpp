// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace loopwarden::page {

// What the page itself needs to know of the daemon's answer to `describe`.
struct PlantLoop {
  std::string tag;
  std::string pv_unit;
  std::string co_unit;
  double sample_time_s = 0.1;
  bool recording = false;
  bool stem = false;
  std::filesystem::path folder;  // of its segments; empty: none
};

struct Plant {
  std::string text;  // the answer, JSON
  std::string config_hash;
  std::string model_hash;
  std::int64_t started_ms = 0;
  double accelerate = 1.0;
  bool alarms = false;   // the daemon takes the page's acknowledgements
  bool control = false;  // and its set points
  std::filesystem::path state_directory;
  std::vector<PlantLoop> loops;
  std::map<std::string, std::size_t, std::less<>> index;  // by tag

  const PlantLoop* find(std::string_view tag) const {
    const auto it = index.find(tag);
    return it == index.end() ? nullptr : &loops[it->second];
  }
};

// Throws std::exception for what is no such answer.
std::shared_ptr<const Plant> plant_of(const nlohmann::json& answer);

}  // namespace loopwarden::page
