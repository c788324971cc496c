// SPDX-License-Identifier: Apache-2.0
#include "services/page/box/plant.hpp"

#include <nlohmann/json.hpp>

namespace loopwarden::page {
namespace {

using nlohmann::json;

// Hashes are text or numbers, by the daemon's version.
std::string word(const json& object, const char* key) {
  const auto it = object.find(key);
  if (it == object.end() || it->is_null()) return {};
  return it->is_string() ? it->get<std::string>() : it->dump();
}

PlantLoop loop_of(const json& one) {
  PlantLoop loop;
  loop.tag = one.at("tag").get<std::string>();
  loop.pv_unit = one.value("pv_unit", "");
  loop.co_unit = one.value("co_unit", "");
  loop.sample_time_s = one.at("sample_time_s").get<double>();
  loop.recording = one.value("recording", false);
  loop.stem = one.value("stem", false);
  loop.folder = word(one, "folder");
  return loop;
}

}  // namespace

std::shared_ptr<const Plant> plant_of(const json& answer) {
  auto plant = std::make_shared<Plant>();
  plant->text = answer.dump(-1, ' ', false, json::error_handler_t::replace);
  plant->config_hash = word(answer, "config_hash");
  plant->model_hash = word(answer, "model_hash");
  plant->started_ms = answer.value("started_ms", std::int64_t{0});
  plant->accelerate = answer.value("accelerate", 1.0);
  plant->state_directory = word(answer, "state_directory");
  if (const auto page = answer.find("page"); page != answer.end() && page->is_object()) {
    plant->alarms = page->value("alarms", false);
    plant->control = page->value("control", false);
  }
  for (const json& one : answer.at("loops")) {
    plant->index[one.at("tag").get<std::string>()] = plant->loops.size();
    plant->loops.push_back(loop_of(one));
  }
  return plant;
}

}  // namespace loopwarden::page
