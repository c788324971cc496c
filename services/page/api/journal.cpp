// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "protocol/ask.hpp"
#include "services/page/api/body.hpp"
#include "services/page/api/handlers.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

constexpr std::int64_t kMostLines = 1000;
constexpr std::size_t kMostCsvLines = 200'000;  // as many as the daemon keeps

// What the query asks for, as the daemon's request.
json request_for(const http::Request& request, std::int64_t most) {
  check_query(request, {"before_id", "most", "loop", "kind", "text", "from_ms", "to_ms"});
  json wanted = {{"request", "journal"}, {"most", most}};
  for (const char* key : {"loop", "kind", "text"}) {
    std::string text = text_in(request, key, 200);
    if (!text.empty()) wanted[key] = std::move(text);
  }
  for (const char* key : {"from_ms", "to_ms"}) {
    if (const auto value = whole_in(request, key, 0, kLastMoment_ms)) wanted[key] = *value;
  }
  if (const auto id = whole_in(request, "before_id", 0, INT64_MAX)) wanted["before_id"] = *id;
  return wanted;
}

constexpr std::array kColumns{
    "id",   "utc_ms", "kind", "loop", "alarm",  "from",  "to", "severity_percent",
    "peer", "what",   "old",  "new",  "result", "reason"};

// A cell for spreadsheets: what they would take for a formula gets a quote before it.
std::string cell(const json& value) {
  if (value.is_null()) return {};
  if (!value.is_string()) return value.dump();
  std::string text = value.get<std::string>();
  if (!text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos) {
    text.insert(0, 1, '\'');
  }
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

class LinesAsCsv final : public http::Source {
 public:
  LinesAsCsv(protocol::Daemon& daemon, json request)
      : daemon_(daemon), request_(std::move(request)) {}

  std::string next() override {
    std::string text;
    if (!begun_) text = fmt::format("{}\n", fmt::join(kColumns, ","));
    begun_ = true;
    if (ended_ || lines_ >= kMostCsvLines) return text;
    const json lines = daemon_.ask(request_).at("lines");
    for (const json& line : lines) {
      for (const char* key : kColumns) text += cell(line.value(key, json())) + ',';
      text.back() = '\n';
      request_["before_id"] = line.at("id");
    }
    lines_ += lines.size();
    ended_ = lines.size() < static_cast<std::size_t>(kMostLines);
    return text;
  }

 private:
  protocol::Daemon& daemon_;
  json request_;
  bool begun_ = false;
  bool ended_ = false;
  std::size_t lines_ = 0;
};

}  // namespace

http::Response journal(Context& context, const Call& call) {
  const std::int64_t most = whole_in(call.request, "most", 1, kMostLines).value_or(100);
  return json_response(context.daemon.ask(request_for(call.request, most)));
}

http::Response journal_csv(Context& context, const Call& call) {
  http::Response response;
  response.content_type = "text/csv; charset=utf-8";
  response.headers.emplace_back("Content-Disposition", "attachment; filename=\"journal.csv\"");
  response.source =
      std::make_unique<LinesAsCsv>(context.daemon, request_for(call.request, kMostLines));
  return response;
}

}  // namespace loopwarden::page::api
