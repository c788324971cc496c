// SPDX-License-Identifier: Apache-2.0
// The test that the newest explanation of a loop proposes: shows it, and carries it out for an
// engineer. The plan is always the file in the folder of the alarm.
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/digest/digest.hpp"
#include "config/loop_model_reader.hpp"
#include "daemon/protocol/ask.hpp"
#include "model/effects/catalogue.hpp"
#include "services/page/api/body.hpp"
#include "services/page/api/gate.hpp"
#include "services/page/api/handlers.hpp"
#include "services/page/api/tags.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;
using protocol::TestPlanFile;

constexpr const char* kPlanFile = "next_test.yaml";

struct FoundPlan {
  std::string evidence;  // its folder
  std::string id;        // changes with the text
  TestPlanFile plan;
};

std::optional<FoundPlan> plan_of(Context& context, const std::string& tag) {
  const auto now = ask(context.daemon, protocol::LoopRequest{tag});
  if (!now.explanation) return std::nullopt;
  FoundPlan found;
  found.evidence = std::filesystem::path(now.explanation->folder).filename().string();
  const auto text = context.reports.evidence_file(found.evidence, kPlanFile);
  if (!text) return std::nullopt;
  auto loaded = protocol::read_test_plan_text(kPlanFile, *text);
  if (!loaded || loaded->loop != tag) return std::nullopt;
  found.id = fmt::format("{:08x}", base::crc32(*text));
  found.plan = std::move(*loaded);
  return found;
}

json plan_json(const FoundPlan& found) {
  const TestPlanFile& plan = found.plan;
  const bool manual = estimator::in_manual(plan.move.kind);
  json outcomes = json::array();
  for (const protocol::PlannedExplanation& e : plan.explanations) {
    const effects::Descriptor* info =
        e.effects.empty() ? nullptr : effects::find_effect(e.effects.front());
    outcomes.push_back({{"name", protocol::title_of(e.effects)},
                        {"probability", e.probability},
                        {"remedy", info != nullptr ? info->remedy : "No repair is needed."}});
  }
  return {{"id", found.id},
          {"evidence", found.evidence},
          {"move", estimator::to_text(plan.move.kind)},
          {"manual", manual},
          {"from", plan.from},
          {"size", plan.move.size},
          {"duration_s", estimator::duration_s(plan.move)},
          {"pv_swing", plan.pv_swing},
          {"output_swing", plan.output_swing},
          {"pv_limits", plan.pv_limits},
          {"co_limits", plan.co_limits},
          {"probability_right", plan.probability_right},
          {"probability_wrong", plan.probability_wrong},
          {"planned_ms", 1000 * plan.planned_at},
          {"outcomes", std::move(outcomes)}};
}

json state_json(const planned_test::TestState& state) {
  constexpr std::array kPhases{"moving", "restoring", "judging", "over"};
  const auto text = [](const std::string& words) { return words.empty() ? json() : json(words); };
  return {{"phase", kPhases[static_cast<std::size_t>(state.phase)]},
          {"by", state.by},
          {"time_s", state.now.time_s},
          {"duration_s", state.duration_s},
          {"ended_early", text(state.ended_early)},
          {"restored", state.restored},
          {"sentence", text(state.sentence)}};
}

void check_may_test(const Context& context, const BoxState& state,
                    const protocol::LoopDescription& loop) {
  if (!context.settings.control) throw ApiError(403, "page.yaml has no control: true");
  if (!state.about.page.tests) {
    throw ApiError(403, "loopwardend.yaml has no page: {tests: true}, so the page can't test");
  }
  if (loop.control == "elsewhere") {
    throw ApiError(403, "another controller has this loop: print the slip for its operator");
  }
}

// Returns the plan with its files. Throws ApiError if one is missing or unreadable.
planned_test::WantedTest wanted(const Context& context, FoundPlan found,
                                const protocol::Person& person) {
  const auto read = [&](const std::string& name) {
    auto text = context.reports.evidence_file(found.evidence, name);
    if (!text) throw ApiError(409, name + " of the plan is missing");
    return std::move(*text);
  };
  auto model = config::read_model_text(found.plan.model, read(found.plan.model));
  if (!model) throw ApiError(409, "this page can't read the model of the plan");
  record::Record record = record::parse_record(read(found.plan.record), found.plan.record);
  return {std::move(found.plan), std::move(*model), std::move(record), person};
}

void start(Context& context, const Call& call, const protocol::LoopDescription& loop,
           const json& confirm) {
  check_keys(confirm, "confirm", {"tag", "plan"});
  if (text_at(confirm, "tag", 128) != loop.tag) {
    throw ApiError(400, "the typed tag is that of another loop", "confirm.tag");
  }
  std::optional<FoundPlan> found = plan_of(context, loop.tag);
  if (!found || found->id != text_at(confirm, "plan", 16)) {
    throw ApiError(409, "the plan has changed meanwhile; read it again", "confirm.plan");
  }
  planned_test::WantedTest test =
      wanted(context, std::move(*found), {.user = call.who.user, .address = call.request.peer});
  if (const std::string why = context.tests.why_not(test.plan); !why.empty()) {
    throw ApiError(409, why);
  }
  if (!context.tests.start(std::move(test))) throw ApiError(409, "another test runs");
}

}  // namespace

http::Response planned_test(Context& context, const Call& call) {
  check_query(call.request, {});
  const auto state = context.now().state;
  const std::string tag = loop_at(state, call.request.part(2)).tag;
  const auto found = plan_of(context, tag);
  auto now = context.tests.state(tag, false);
  if (now && now->by == call.who.user) now = context.tests.state(tag, true);
  return json_response(
      {{"plan", found ? plan_json(*found) : json()}, {"test", now ? state_json(*now) : json()}});
}

http::Response act_on_test(Context& context, const Call& call) {
  const auto state = context.now().state;
  const protocol::LoopDescription& loop = loop_at(state, call.request.part(2));
  const json body = object_of(call.request, {"action", "confirm"});
  const std::string action = text_at(body, "action", 16);
  if (action == "stop") {
    if (!context.tests.stop(loop.tag, "stopped by " + call.who.user)) {
      throw ApiError(409, "no test of this loop moves it now");
    }
  } else if (action == "start") {
    check_role(call.who, Role::engineer);
    check_may_test(context, *state, loop);
    start(context, call, loop, body.value("confirm", json()));
  } else {
    throw ApiError(400, "expected start or stop", "action");
  }
  return json_response(json::object());
}

}  // namespace loopwarden::page::api
