// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/ask.hpp"
#include "services/page/api/body.hpp"
#include "services/page/api/handlers.hpp"
#include "services/page/api/tags.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestReason = 200;  // bytes, as the daemon takes them

json with_evidence(json answer, files::ReportStore& store) {
  const auto folder = answer.find("evidence");
  if (folder == answer.end() || !folder->is_string()) return answer;
  const std::filesystem::path path = folder->get<std::string>();
  const std::string id = path.filename().string();
  answer["evidence"] = {{"id", id}, {"folder", path.string()}, {"files", store.evidence_files(id)}};
  return answer;
}

}  // namespace

const protocol::LoopDescription& loop_at(const std::shared_ptr<const BoxState>& state,
                                         std::string_view tag) {
  if (!state) {
    throw protocol::DaemonError(protocol::DaemonError::Kind::down,
                                "the daemon has not answered yet; try again");
  }
  const protocol::LoopDescription* loop = state->find(tag);
  if (loop == nullptr) throw ApiError(404, "there is no loop of that name");
  return *loop;
}

namespace {

// Returns the daemon's answer to a request about the loop in the address.
template <class Request>
http::Response ask_about_loop(Context& context, const Call& call) {
  check_query(call.request, {});
  const auto state = context.now().state;
  const protocol::LoopDescription& loop = loop_at(state, call.request.part(2));
  return json_response(context.daemon.ask(Request{loop.tag}));
}

}  // namespace

http::Response loop(Context& context, const Call& call) {
  return ask_about_loop<protocol::LoopRequest>(context, call);
}

http::Response windows(Context& context, const Call& call) {
  return ask_about_loop<protocol::WindowsRequest>(context, call);
}

http::Response loop_alarms(Context& context, const Call& call) {
  return ask_about_loop<protocol::AlarmDesignRequest>(context, call);
}

namespace {

// Returns the owner of the alarm in the address: a loop's tag, or the box itself.
std::string owner_of(const std::shared_ptr<const BoxState>& state, std::string_view name) {
  constexpr std::string_view kBox = "box";
  return state && name == kBox ? std::string(kBox) : loop_at(state, name).tag;
}

}  // namespace

http::Response loop_alarm(Context& context, const Call& call) {
  check_query(call.request, {});
  const auto state = context.now().state;
  json answer = context.daemon.ask(protocol::ExplainRequest{owner_of(state, call.request.part(2)),
                                                            std::string(call.request.part(4))});
  return json_response(with_evidence(std::move(answer), context.reports));
}

namespace {

// Returns the owner of the alarm in the address if alarms may be acted on.
std::string owner_to_act_on(const std::shared_ptr<const BoxState>& state, const Call& call) {
  std::string owner = owner_of(state, call.request.part(2));
  if (!state->about.page.alarms) {
    throw ApiError(403, "loopwardend.yaml has no page: {alarms: true}, so alarms are only shown");
  }
  return owner;
}

}  // namespace

http::Response acknowledge_incident(Context& context, const Call& call) {
  const auto state = context.now().state;
  const std::string owner = owner_to_act_on(state, call);
  const json body = object_of(call.request, {"action", "reason"});
  if (text_at(body, "action", 32) != "acknowledge") {
    throw ApiError(400, "an incident can be acknowledged; its alarms have all actions", "action");
  }
  return json_response(context.orders.ask(
      protocol::AcknowledgeIncidentRequest{.loop = owner,
                                           .incident = std::string(call.request.part(4)),
                                           .reason = text_or(body, "reason", kLongestReason, ""),
                                           .user = call.who.user,
                                           .address = call.request.peer}));
}

http::Response act_on_alarm(Context& context, const Call& call) {
  const auto state = context.now().state;
  const std::string owner = owner_to_act_on(state, call);
  const json body = object_of(call.request, {"action", "minutes", "reason"});
  protocol::AlarmRequest order{.loop = owner,
                               .alarm = std::string(call.request.part(4)),
                               .action = text_at(body, "action", 32),
                               .reason = text_or(body, "reason", kLongestReason, ""),
                               .user = call.who.user,
                               .address = call.request.peer};
  if (order.action == "shelve") {
    order.minutes = static_cast<std::uint64_t>(whole_at(body, "minutes", 1, 1440));
  }
  return json_response(context.orders.ask(order));
}

http::Response note(Context& context, const Call& call) {
  const auto state = context.now().state;
  const std::string owner = owner_to_act_on(state, call);
  const json body = object_of(call.request, {"text", "about_ms"});
  protocol::NoteRequest request{.loop = owner,
                                .text = text_at(body, "text", kLongestReason),
                                .user = call.who.user,
                                .address = call.request.peer};
  if (body.contains("about_ms")) {
    request.about_ms = static_cast<std::uint64_t>(whole_at(body, "about_ms", 0, kLastMoment_ms));
  }
  return json_response(context.orders.ask(request));
}

}  // namespace loopwarden::page::api
