// SPDX-License-Identifier: Apache-2.0
#include "daemon/reports/report.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "base/file.hpp"

namespace loopwarden::daemon::reports {
namespace {

using nlohmann::json;

constexpr std::size_t kMostBytes = 64UL * 1024UL;

std::filesystem::path file_in(const std::filesystem::path& folder) { return folder / "about.json"; }

State state_of(const std::string& name) {
  for (const State state : {State::waiting, State::running, State::done}) {
    if (name == to_text(state)) return state;
  }
  return State::failed;
}

}  // namespace

const char* to_text(Kind kind) noexcept {
  constexpr std::array kNames{"gap", "commission", "survey", "diagnose", "receipt"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::optional<Kind> kind_of(std::string_view name) noexcept {
  const auto* const found =
      std::find_if(kKinds.begin(), kKinds.end(), [&](Kind kind) { return name == to_text(kind); });
  return found == kKinds.end() ? std::nullopt : std::optional(*found);
}

const char* page_of(Kind kind) noexcept {
  return kind == Kind::survey ? "survey.html" : "report.html";
}

const char* to_text(State state) noexcept {
  constexpr std::array kNames{"waiting", "running", "done", "failed"};
  return kNames[static_cast<std::size_t>(state)];
}

std::string name_of(const Order& order, std::int64_t asked_ms) {
  return fmt::format("{}-{}-{:%Y%m%dT%H%M%S}{:03}Z", order.loop, to_text(order.kind),
                     fmt::gmtime(static_cast<std::time_t>(asked_ms / 1000)), asked_ms % 1000);
}

void write_about(const Report& r, const std::filesystem::path& folder) {
  const json text = {{"name", r.name},
                     {"loop", r.order.loop},
                     {"kind", to_text(r.order.kind)},
                     {"from_ms", r.order.from_ms},
                     {"to_ms", r.order.to_ms},
                     {"by", r.order.by},
                     {"twin", r.order.twin},
                     {"due_ms", r.order.due_ms},
                     {"asked_ms", r.asked_ms},
                     {"state", to_text(r.state)},
                     {"started_ms", r.started_ms},
                     {"ended_ms", r.ended_ms},
                     {"sentence", r.sentence}};
  const auto error = base::replace_file(
      file_in(folder), text.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
  if (error) throw std::runtime_error(error->text());
}

std::optional<Report> read_about(const std::filesystem::path& folder) {
  const std::optional<std::string> text = base::read_file(file_in(folder), kMostBytes);
  if (!text) return std::nullopt;
  try {
    const json about = json::parse(*text);
    const std::optional<Kind> kind = kind_of(about.at("kind").get<std::string>());
    Report r;
    r.name = about.at("name").get<std::string>();
    if (!kind || r.name != folder.filename()) return std::nullopt;
    r.order = {.loop = about.at("loop").get<std::string>(),
               .kind = *kind,
               .from_ms = about.at("from_ms").get<std::int64_t>(),
               .to_ms = about.at("to_ms").get<std::int64_t>(),
               .by = about.at("by").get<std::string>(),
               .twin = about.value("twin", ""),
               .due_ms = about.value("due_ms", std::int64_t{0})};
    r.asked_ms = about.at("asked_ms").get<std::int64_t>();
    r.state = state_of(about.at("state").get<std::string>());
    r.started_ms = about.at("started_ms").get<std::int64_t>();
    r.ended_ms = about.at("ended_ms").get<std::int64_t>();
    r.sentence = about.at("sentence").get<std::string>();
    std::error_code unknown;
    r.has_page = std::filesystem::exists(folder / page_of(*kind), unknown);
    return r;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace loopwarden::daemon::reports
