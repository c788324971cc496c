// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "daemon/protocol/ask.hpp"
#include "services/page/api/body.hpp"
#include "services/page/api/handlers.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

constexpr std::int64_t kMostLines = 1000;
constexpr std::size_t kMostCsvLines = 200'000;  // as many as the daemon keeps

protocol::JournalRequest request_for(const http::Request& request, std::int64_t most) {
  check_query(request, {"before_id", "most", "loop", "kind", "text", "from_ms", "to_ms"});
  protocol::JournalRequest wanted{.most = static_cast<std::uint64_t>(most)};
  const auto take_text = [&](const char* key, protocol::Maybe<std::string>& to) {
    std::string text = text_in(request, key, 200);
    if (!text.empty()) to = std::move(text);
  };
  const auto take_whole = [&](const char* key, std::int64_t high,
                              protocol::Maybe<std::uint64_t>& to) {
    if (const auto value = whole_in(request, key, 0, high)) to = static_cast<std::uint64_t>(*value);
  };
  take_text("loop", wanted.loop);
  take_text("kind", wanted.kind);
  take_text("text", wanted.text);
  take_whole("from_ms", kLastMoment_ms, wanted.from_ms);
  take_whole("to_ms", kLastMoment_ms, wanted.to_ms);
  take_whole("before_id", INT64_MAX, wanted.before_id);
  return wanted;
}

constexpr std::array kColumns{
    "id",   "utc_ms", "kind", "loop", "alarm",  "from",  "to", "severity_percent",
    "peer", "what",   "old",  "new",  "result", "reason"};

// Returns a cell for spreadsheets. Text that they would take for a formula gets a leading quote.
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
  LinesAsCsv(protocol::Daemon& daemon, protocol::JournalRequest request)
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
      request_.before_id = line.at("id").get<std::uint64_t>();
    }
    lines_ += lines.size();
    ended_ = lines.size() < static_cast<std::size_t>(kMostLines);
    return text;
  }

 private:
  protocol::Daemon& daemon_;
  protocol::JournalRequest request_;
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
