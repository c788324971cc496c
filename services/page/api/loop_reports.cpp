// SPDX-License-Identifier: Apache-2.0
// Lists the reports that the daemon has made from a loop's record, and takes an engineer's request
// for a new one.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/protocol/ask.hpp"
#include "services/page/api/body.hpp"
#include "services/page/api/handlers.hpp"
#include "services/page/api/tags.hpp"

namespace loopwarden::page::api {

using nlohmann::json;

// Adds `id` to each report that the page can show. The index of reports may be some seconds old.
http::Response loop_reports(Context& context, const Call& call) {
  check_query(call.request, {});
  const auto state = context.now().state;
  json answer =
      context.daemon.ask(protocol::ReportsRequest{loop_at(state, call.request.part(2)).tag});
  const auto index = context.reports.reports();
  for (json& report : answer.at("reports")) {
    const std::string page = report.value("page", "");
    if (page.empty()) continue;
    const auto shown = std::find_if(index->begin(), index->end(), [&](const files::Report& one) {
      return fmt::format("{}", fmt::join(one.parts, "/")) == page;
    });
    if (shown != index->end()) report["id"] = shown->id;
  }
  return json_response(answer);
}

http::Response ask_for_report(Context& context, const Call& call) {
  const auto state = context.now().state;
  const std::string tag = loop_at(state, call.request.part(2)).tag;
  if (!state->about.page.reports) {
    throw ApiError(403,
                   "loopwardend.yaml has no page: {reports: true}, so reports can't be requested");
  }
  const json body = object_of(call.request, {"kind", "from_ms", "to_ms"});
  const protocol::ReportRequest request{
      .loop = tag,
      .kind = text_at(body, "kind", 32),
      .from_ms = static_cast<std::uint64_t>(whole_at(body, "from_ms", 0, kLastMoment_ms)),
      .to_ms = static_cast<std::uint64_t>(whole_at(body, "to_ms", 0, kLastMoment_ms)),
      .user = call.who.user,
      .address = call.request.peer};
  const auto taken = ask(context.orders, request);
  if (!taken.taken) {
    throw ApiError(429,
                   fmt::format("{} reports wait already; one is made at a time", taken.waiting));
  }
  return json_response(taken);
}

}  // namespace loopwarden::page::api
