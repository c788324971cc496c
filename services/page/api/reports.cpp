// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/text.hpp"
#include "services/page/api/body.hpp"
#include "services/page/api/handlers.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

// A report has inline scripts. It gets a separate origin, which can't send requests to this page.
constexpr const char* kReportPolicy =
    "sandbox allow-scripts allow-popups; default-src 'none'; style-src 'unsafe-inline'; "
    "script-src 'unsafe-inline'; img-src data:";

json report_json(const files::Report& report) {
  json one = {{"id", report.id},
              {"kind", report.kind},
              {"title", report.title},
              {"utc_ms", report.utc_ms},
              {"bytes", report.bytes}};
  if (!report.loop.empty()) one["loop"] = report.loop;
  if (report.kind == "explanation") one["evidence"] = report.parts[1];
  return one;
}

json column(const std::vector<double>& values) {
  json list = json::array();
  for (const double value : values) list.push_back(std::isfinite(value) ? json(value) : json());
  return list;
}

json samples_json(const std::string& csv) {
  const record::Record record = record::parse_record(csv, "record.csv");
  json samples = {{"t_s", column(record.time_s)}, {"pv", column(record.pv)}};
  if (!record.sp.empty()) samples["sp"] = column(record.sp);
  if (!record.co.empty()) samples["co"] = column(record.co);
  if (!record.stem.empty()) samples["stem"] = column(record.stem);
  return samples;
}

json parsed(const std::optional<std::string>& text) {
  json value = text ? json::parse(*text, nullptr, false) : json();
  return value.is_discarded() ? json() : value;
}

}  // namespace

http::Response reports(Context& context, const Call& call) {
  check_query(call.request, {"evidence"});
  const std::string evidence = text_in(call.request, "evidence", 255);
  const auto reports = context.reports.reports();
  json list = json::array();
  for (const files::Report& report : *reports) {
    const bool wanted =
        evidence.empty() || (report.kind == "explanation" && report.parts[1] == evidence);
    if (wanted) list.push_back(report_json(report));
  }
  return json_response(list);
}

http::Response report(Context& context, const Call& call) {
  check_query(call.request, {});
  const auto& path = call.request.path;
  http::Response response;
  if (path.size() == 2) {
    // Redirects to the address to which the report's own links are relative.
    const auto name = context.reports.name(path[1]);
    if (!name) throw ApiError(404, "there is no such report");
    response.status = 302;
    response.headers.emplace_back("Location",
                                  "/reports/" + path[1] + "/" + base::percent_encoded(*name));
    return response;
  }
  auto content = path.size() < 2 ? std::nullopt
                                 : context.reports.read(path[1], {path.begin() + 2, path.end()});
  if (!content) throw ApiError(404, "there is no such report");
  response.content_type = content->type;
  response.body = std::move(content->bytes);
  response.headers.emplace_back("Content-Security-Policy", kReportPolicy);
  return response;
}

http::Response evidence(Context& context, const Call& call) {
  check_query(call.request, {});
  const std::string id(call.request.part(2));
  const json about = parsed(context.reports.evidence_file(id, "evidence.json"));
  const auto csv = context.reports.evidence_file(id, "record.csv");
  if (about.is_null() || !csv) throw ApiError(404, "there is no such evidence");
  json answer = samples_json(*csv);
  answer["evidence"] = about;
  answer["files"] = context.reports.evidence_files(id);
  answer["explanation"] = parsed(context.reports.evidence_file(id, "explanation.json"));
  answer["replay"] =
      fmt::format("loopwarden replay {}", context.reports.evidence_folder(id).string());
  return json_response(answer);
}

}  // namespace loopwarden::page::api
