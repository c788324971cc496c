// SPDX-License-Identifier: Apache-2.0
#include "services/page/files/report_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <regex>
#include <string_view>
#include <utility>

#include "services/page/files/self_contained.hpp"

namespace loopwarden::page::files {
namespace {

namespace fs = std::filesystem;

constexpr int kMostDepth = 6;
constexpr std::size_t kMostEntries = 200'000;
constexpr std::size_t kMostReportBytes = 32UL * 1024UL * 1024UL;
constexpr std::size_t kMostEvidenceBytes = 8UL * 1024UL * 1024UL;
constexpr std::size_t kHeadBytes = 4096;

// Returns the 64-bit FNV-1a hash. It is the same after every start, so links to a report stay
// valid.
std::string id_of(const std::string& path) {
  std::uint64_t hash = 14'695'981'039'346'656'037ULL;
  for (const char c : path) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 1'099'511'628'211ULL;
  }
  return fmt::format("{:016x}", hash);
}

std::int64_t utc_ms_of(const fs::directory_entry& entry, std::error_code& error) {
  const auto written = entry.last_write_time(error);
  if (error) return 0;
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::file_clock::to_sys(written).time_since_epoch())
      .count();
}

std::vector<std::string> parts_of(const fs::path& relative) {
  std::vector<std::string> parts;
  for (const fs::path& part : relative) parts.push_back(part.string());
  return parts;
}

std::string title_in(std::string_view html) {
  constexpr std::string_view kBegin = "<title>";
  const std::size_t begin = html.find(kBegin);
  if (begin == std::string_view::npos) return {};
  html.remove_prefix(begin + kBegin.size());
  std::string title(html.substr(0, std::min(html.find('<'), std::size_t{200})));
  for (const auto& [name, sign] :
       {std::pair{"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&amp;", "&"}}) {
    for (std::size_t at = title.find(name); at != std::string::npos;
         at = title.find(name, at + 1)) {
      title.replace(at, std::string_view(name).size(), sign);
    }
  }
  return title;
}

// Patterns of the daemon's names.
constexpr const char* kTag = "([A-Za-z0-9][A-Za-z0-9._-]{0,31})";
constexpr const char* kTime = "[0-9]{8}T[0-9]{9}Z";

// Returns TAG and KIND of TAG-KIND-TIME, the folder of a report that was requested on the page;
// otherwise empty texts.
std::pair<std::string, std::string> loop_and_kind(const std::vector<std::string>& parts) {
  static const std::regex name(
      fmt::format("{}-(gap|commission|survey|diagnose|receipt)-{}", kTag, kTime));
  std::smatch found;
  if (parts.size() < 3 || parts.front() != "reports" || !std::regex_match(parts[1], found, name))
    return {};
  return {found[1], found[2]};
}

// Returns the kind by place and name, then by the beginning of the title from the workbench.
std::string kind_of(const std::vector<std::string>& parts, std::string_view title) {
  const std::string& name = parts.back();
  const std::string asked = loop_and_kind(parts).second;
  if (asked == "diagnose") return "diagnosis";
  if (asked == "commission") return "commissioning";
  if (!asked.empty()) return asked;
  if (parts.front() == "evidence") return "explanation";
  if (name == "training.html") return "training";
  if (name == "survey.html" || title.starts_with("Survey")) return "survey";
  if (title.starts_with("Receipt")) return "receipt";
  if (title.starts_with("Gap")) return "gap";
  if (title.starts_with("Commission")) return "commissioning";
  if (title.starts_with("Training")) return "training";
  return "other";
}

// Returns the loop. Evidence is called TIME-TAG-ALARM.
std::string loop_of(const std::vector<std::string>& parts) {
  if (std::string loop = loop_and_kind(parts).first; !loop.empty()) return loop;
  if (parts.size() < 3 || parts.front() != "evidence") return {};
  static const std::regex name(fmt::format("{}-{}-[a-z_]+", kTime, kTag));
  std::smatch found;
  return std::regex_match(parts[1], found, name) ? found[1].str() : std::string();
}

std::string type_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, const char*>, 7> kTypes{
      {{".html", "text/html; charset=utf-8"},
       {".css", "text/css; charset=utf-8"},
       {".svg", "image/svg+xml"},
       {".png", "image/png"},
       {".csv", "text/csv; charset=utf-8"},
       {".json", "application/json"},
       {".yaml", "text/plain; charset=utf-8"}}};
  for (const auto& [ending, type] : kTypes) {
    if (name.ends_with(ending)) return type;
  }
  return {};
}

}  // namespace

Report ReportStore::look_at(const fs::path& path, std::int64_t utc_ms, std::uintmax_t bytes) {
  Report report;
  report.parts = parts_of(path);
  report.id = id_of(path.string());
  report.utc_ms = utc_ms;
  report.bytes = bytes;
  report.title = title_in(folder_.read_start(report.parts, kHeadBytes).value_or(""));
  report.kind = kind_of(report.parts, report.title);
  report.loop = loop_of(report.parts);
  if (report.title.empty()) report.title = path.filename().string();
  return report;
}

void ReportStore::look_into(const fs::directory_entry& entry, std::map<std::string, Known>& found) {
  std::error_code gone;
  if (entry.path().extension() != ".html" || !entry.is_regular_file(gone)) return;
  const std::string path = entry.path().lexically_relative(folder_.path()).string();
  const std::int64_t utc_ms = utc_ms_of(entry, gone);
  const std::uintmax_t bytes = entry.file_size(gone);
  if (gone) return;
  const auto known = known_.find(path);
  const bool same =
      known != known_.end() && known->second.utc_ms == utc_ms && known->second.bytes == bytes;
  found[path] = same ? known->second : Known{utc_ms, bytes, look_at(path, utc_ms, bytes)};
}

void ReportStore::walk() {
  const auto begun = Clock::now();
  std::map<std::string, Known> found;
  std::error_code error;
  constexpr auto kOptions = fs::directory_options::skip_permission_denied;
  fs::recursive_directory_iterator it(folder_.path(), kOptions, error);
  for (std::size_t seen = 0; !error && it != fs::recursive_directory_iterator() &&
                             seen < kMostEntries && found.size() < kMost;
       it.increment(error), ++seen) {
    const fs::directory_entry& entry = *it;
    std::error_code gone;
    if (entry.is_symlink(gone) || !is_sound_name(entry.path().filename().string())) {
      it.disable_recursion_pending();
      continue;
    }
    // Segments are many, and no reports.
    const bool segments = it.depth() == 0 && entry.path().filename() == "segments";
    if (it.depth() >= kMostDepth || segments) it.disable_recursion_pending();
    look_into(entry, found);
  }
  known_ = std::move(found);
  auto all = std::make_shared<std::vector<Report>>();
  for (const auto& [path, one] : known_) all->push_back(one.report);
  std::stable_sort(all->begin(), all->end(),
                   [](const Report& a, const Report& b) { return a.utc_ms > b.utc_ms; });
  const auto ended = Clock::now();
  const std::lock_guard lock(mutex_);
  index_ = std::move(all);
  due_ = ended + std::max<Clock::duration>(fresh_, 9 * (ended - begun));
}

ReportStore::List ReportStore::reports() {
  const auto now_there = [this](Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    return std::pair(index_, index_ != nullptr && now < due_);
  };
  const auto [before, is_fresh] = now_there(Clock::now());
  if (is_fresh) return before;
  std::unique_lock walking(walking_, std::defer_lock);
  // Before the first index, all callers wait for it.
  before ? static_cast<void>(walking.try_lock()) : walking.lock();
  if (!walking.owns_lock()) return before;
  if (!now_there(Clock::now()).second) walk();
  return now_there(Clock::now()).first;
}

std::optional<std::vector<std::string>> ReportStore::parts_of_report(const std::string& id) {
  List index = [this] {
    const std::lock_guard lock(mutex_);
    return index_;
  }();
  if (!index) index = reports();
  const auto report =
      std::find_if(index->begin(), index->end(), [&](const Report& one) { return one.id == id; });
  return report == index->end() ? std::nullopt : std::optional(report->parts);
}

std::optional<std::string> ReportStore::name(const std::string& id) {
  const auto parts = parts_of_report(id);
  return parts ? std::optional(parts->back()) : std::nullopt;
}

std::optional<ReportStore::Content> ReportStore::read(const std::string& id,
                                                      const std::vector<std::string>& below) {
  auto parts = parts_of_report(id);
  const std::string type = below.empty() ? std::string() : type_of(below.back());
  if (!parts || type.empty()) return std::nullopt;
  parts->pop_back();
  const auto read_below = [&](const std::vector<std::string>& more) {
    std::vector<std::string> path = *parts;
    path.insert(path.end(), more.begin(), more.end());
    return folder_.read(path, kMostReportBytes);
  };
  std::optional<std::string> bytes = read_below(below);
  if (!bytes) return std::nullopt;
  if (type.starts_with("text/html")) bytes = self_contained(*bytes, below, read_below);
  return Content{type, std::move(*bytes)};
}

std::vector<std::string> ReportStore::evidence_files(const std::string& id) const {
  return folder_.list(evidence_parts(id), 100);
}

std::optional<std::string> ReportStore::evidence_file(const std::string& id,
                                                      const std::string& name) const {
  std::vector<std::string> parts = evidence_parts(id);
  parts.push_back(name);
  return folder_.read(parts, kMostEvidenceBytes);
}

fs::path ReportStore::evidence_folder(const std::string& id) const {
  fs::path folder = folder_.path();
  for (const std::string& part : evidence_parts(id)) folder /= part;
  return folder;
}

std::vector<std::string> ReportStore::evidence_parts(const std::string& id) const {
  if (!folder_.list({"evidence", id}, 1).empty()) return {"evidence", id};
  std::error_code gone;
  for (const fs::directory_entry& of : fs::directory_iterator(folder_.path() / "evidence", gone)) {
    const std::string incident = of.path().filename().string();
    if (!folder_.list({"evidence", incident, id}, 1).empty()) return {"evidence", incident, id};
  }
  return {"evidence", id};
}

}  // namespace loopwarden::page::files
