// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "workbench/text/explanation_json.hpp"

#include "model/twin/commission.hpp"
#include "model/effects/catalogue.hpp"
#include "workbench/text/gap_json.hpp"
#include "workbench/text/json_number.hpp"
#include "workbench/text/next_test_text.hpp"

namespace loopwarden::workbench {

using nlohmann::json;

json explanation_json(const twin::Explanation& e, alarm::AlarmKind alarm, double first_s,
                      double period_s) {
  const auto time_s = [&](std::size_t k) { return first_s + period_s * static_cast<double>(k); };
  const bool known = e.from.end > 0;
  json out = {
      {"from_s", time_s(e.at)},
      {"from_between_s", known ? json{time_s(e.from.begin), time_s(e.from.end)} : json(nullptr)},
      {"to_s", time_s(e.stretch.end - 1)}};
  if (!e.usable()) {
    out["verdict"] = "not_explained";
    out["effects"] = json::array();
    out["gap_closed"] = nullptr;
    out["agrees"] = false;
    out["sentence"] = e.result.check.refusal;
    out["next_test"] = nullptr;
    return out;
  }
  const json whole = gap_json(e.result);
  out["verdict"] = whole.at("verdict");
  out["effects"] = whole.at("effects");
  out["gap_closed"] = finite_or_null(e.closed);
  out["agrees"] = twin::agrees(e, alarm);
  out["sentence"] = e.result.sentence;
  out["next_test"] = whole.at("next_test");
  if (const auto& test = e.result.next_test)
    out["next_test"]["text"] = proposed_test_text(test->plan, names_of(*test));
  return out;
}

json first_effect_json(const twin::Explanation& e) {
  if (!e.usable() || e.result.effects.empty()) return nullptr;
  const gap::FoundEffect& effect = e.result.effects.front();
  const control::PidSettings& pid = e.result.model.controller.pid;
  const double span = pid.output_span();
  const effects::Descriptor* info = effects::find_word(effect.spec.name);
  // Returns the size with each parameter at one end of its interval.
  const auto at_end = [&](std::size_t end) {
    effects::EffectSpec spec = effect.spec;
    for (const auto& [name, interval] : effect.interval) {
      if (const auto found = spec.parameters.find(name); found != spec.parameters.end()) {
        found->second = interval[end];
      }
    }
    return twin::size_percent(spec, span);
  };
  return {{"name", effect.spec.name},
          {"number", info != nullptr ? info->number : 0},
          {"block", effects::to_text(effect.block)},
          {"size_percent", finite_or_null(twin::size_percent(effect.spec, span))},
          {"low_percent", finite_or_null(at_end(0))},
          {"high_percent", finite_or_null(at_end(1))},
          {"confidence", effect.confidence},
          {"alternatives", effect.alternatives},
          {"evidence", effect.evidence},
          {"remedy", info != nullptr ? std::string(info->remedy) : std::string()}};
}

}  // namespace loopwarden::workbench
