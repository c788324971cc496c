// SPDX-License-Identifier: Apache-2.0
#include "daemon/reports/report_queue.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <ctime>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/child_process.hpp"
#include "base/file.hpp"
#include "base/text.hpp"

namespace loopwarden::daemon::reports {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{100};
constexpr std::chrono::seconds kBetweenLooks{1};  // between checks of the disk
constexpr std::streamoff kTail = 4096;            // bytes of the command's output that are read
constexpr std::size_t kLongestSentence = 600;     // bytes
constexpr std::string_view kProgress = "progress: ";
constexpr const char* kOutput = "output.txt";
constexpr const char* kScratch = "tmp";
constexpr const char* kRecords = "records";

std::string utc_text(std::int64_t utc_ms) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z",
                     fmt::gmtime(static_cast<std::time_t>(utc_ms / 1000)), utc_ms % 1000);
}

// Returns the last lines of the command's output.
std::vector<std::string> last_lines(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream) return {};
  const std::streamoff size = stream.tellg();
  stream.seekg(std::max<std::streamoff>(0, size - kTail));
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

bool is_progress(const std::string& line) { return line.starts_with(kProgress); }

// Removes the folder's path from a text, because it is useless to readers in a browser.
std::string for_readers(std::string text, const fs::path& folder) {
  const std::string prefix = folder.string() + "/";
  for (std::size_t at = 0; (at = text.find(prefix)) != std::string::npos;) {
    text.erase(at, prefix.size());
  }
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
  return std::string(base::cut(text, kLongestSentence));
}

std::string sentence_in(const fs::path& folder) {
  const std::vector<std::string> lines = last_lines(folder / kOutput);
  const auto last = std::find_if_not(lines.rbegin(), lines.rend(), is_progress);
  return last == lines.rend() ? std::string() : for_readers(*last, folder);
}

// Parses "progress: WHAT N %".
void take_progress(const std::string& line, Report& report) {
  const std::string_view text = std::string_view(line).substr(kProgress.size());
  if (!text.ends_with(" %")) return;
  const std::string_view told = text.substr(0, text.size() - 2);
  const std::size_t blank = told.rfind(' ');
  if (blank == std::string_view::npos) return;
  int percent = 0;
  const auto [end, error] =
      std::from_chars(told.data() + blank + 1, told.data() + told.size(), percent);
  if (error != std::errc{} || end != told.data() + told.size()) return;
  report.doing = told.substr(0, blank);
  report.percent = std::clamp(percent, 0, 100);
}

// Returns whether the report waits for others, and not for its time.
bool in_queue(const Report& report) {
  return report.state == State::waiting && report.order.due_ms == 0;
}

// Removes the leftovers of a killed command: all files except those that describe the report.
void clear(const fs::path& folder) {
  std::error_code gone;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, gone)) {
    const fs::path name = entry.path().filename();
    if (name != "about.json" && name != kOutput) fs::remove_all(entry.path(), gone);
  }
}

}  // namespace

std::optional<Report> ReportQueue::post(Order order) {
  const std::int64_t now_ms = callbacks_.now_ms();
  Report report;
  {
    const std::lock_guard lock(mutex_);
    const auto waiting = static_cast<std::size_t>(
        std::count_if(all_.begin(), all_.end(), [](const Entry& e) { return in_queue(e.report); }));
    if (waiting >= settings_.most_waiting) return std::nullopt;
    report = add(std::move(order), now_ms);
    report.place = waiting + 1;
  }
  callbacks_.wake();
  return report;
}

void ReportQueue::post_later(Order order) {
  const std::int64_t now_ms = callbacks_.now_ms();
  {
    const std::lock_guard lock(mutex_);
    const auto waits = std::find_if(all_.begin(), all_.end(), [&](const Entry& e) {
      return e.report.state == State::waiting && e.report.order.due_ms > 0 &&
             e.report.order.loop == order.loop && e.report.order.kind == order.kind;
    });
    if (waits == all_.end()) {
      add(std::move(order), now_ms);
    } else {
      waits->report.order.to_ms = order.to_ms;
      waits->report.order.due_ms = order.due_ms;
      waits->on_disk = false;
    }
  }
  callbacks_.wake();  // to write it to the disk
}

// The lock is held.
Report ReportQueue::add(Order order, std::int64_t now_ms) {
  Report report;
  report.asked_ms = now_ms;
  report.order = std::move(order);
  const auto is_taken = [&](const Entry& e) { return e.report.name == report.name; };
  do {
    report.name = name_of(report.order, report.asked_ms);
  } while (std::any_of(all_.begin(), all_.end(), is_taken) && ++report.asked_ms > 0);
  all_.push_back({report, false});
  return report;
}

void ReportQueue::look_at_due() const {
  const std::int64_t now_ms = callbacks_.now_ms();
  const auto is_due = [&](const Entry& e) {
    const std::int64_t due_ms = e.report.order.due_ms;
    return e.report.state == State::waiting && due_ms > 0 && due_ms <= now_ms;
  };
  bool due = false;
  {
    const std::lock_guard lock(mutex_);
    due = std::any_of(all_.begin(), all_.end(), is_due);
  }
  if (due) callbacks_.wake();
}

std::size_t ReportQueue::waiting_before(const Report& report) const {
  std::size_t before = 0;
  for (const Entry& e : all_) {
    if (e.report.name == report.name) break;
    if (in_queue(e.report)) ++before;
  }
  return before;
}

std::optional<std::vector<Report>> ReportQueue::of(const std::string& loop) const {
  const std::lock_guard lock(mutex_);
  if (!is_loaded_) return std::nullopt;
  std::vector<Report> reports;
  for (auto e = all_.rbegin(); e != all_.rend(); ++e) {
    if (e->report.order.loop != loop) continue;
    Report& report = reports.emplace_back(e->report);
    report.place = in_queue(report) ? waiting_before(report) + 1 : 0;
  }
  return reports;
}

void ReportQueue::change(const Report& report) {
  const std::lock_guard lock(mutex_);
  for (Entry& e : all_) {
    if (e.report.name == report.name) e.report = report;
  }
}

void ReportQueue::write(const Report& report) const noexcept {
  try {
    fs::create_directories(folder_of(report));
    write_about(report, folder_of(report));
  } catch (const std::exception& e) {
    spdlog::warn("report: {}", e.what());
  }
}

void ReportQueue::load() {
  std::vector<Entry> found;
  std::error_code error;
  for (fs::directory_iterator it(settings_.folder, error), end; !error && it != end;
       it.increment(error)) {
    std::optional<Report> report = read_about(it->path());
    if (!report) continue;
    if (!report->ended() && report->order.due_ms > 0) {
      report->state = State::waiting;
      clear(it->path());
    } else if (!report->ended()) {
      report->state = State::failed;
      report->ended_ms = callbacks_.now_ms();
      report->sentence = "The daemon was restarted before it was done.";
      clear(it->path());
      write(*report);
    }
    found.push_back({std::move(*report), true});
  }
  // Sorts the oldest first. A time in the future is from before the clock was set back. It counts
  // as the oldest.
  if (found.size() > 1) {
    const auto key = [now_ms = callbacks_.now_ms()](const Entry& e) {
      return std::pair(e.report.asked_ms <= now_ms, e.report.asked_ms);
    };
    std::sort(found.begin(), found.end(),
              [&](const Entry& a, const Entry& b) { return key(a) < key(b); });
  }
  const std::lock_guard lock(mutex_);
  all_.insert(all_.begin(), found.begin(), found.end());
  is_loaded_ = true;
}

// Writes new waiting reports to the disk, so that they are known after a restart.
void ReportQueue::write_new() {
  std::vector<Report> fresh;
  {
    const std::lock_guard lock(mutex_);
    for (Entry& e : all_) {
      if (!std::exchange(e.on_disk, true)) fresh.push_back(e.report);
    }
  }
  for (const Report& report : fresh) write(report);
}

std::optional<Report> ReportQueue::begin() {
  const std::int64_t now_ms = callbacks_.now_ms();
  const std::lock_guard lock(mutex_);
  const auto next = std::find_if(all_.begin(), all_.end(), [&](const Entry& e) {
    return e.report.state == State::waiting && e.report.order.due_ms <= now_ms;
  });
  if (next == all_.end()) return std::nullopt;
  next->report.state = State::running;
  next->report.started_ms = now_ms;
  return next->report;
}

bool ReportQueue::run_next(const Stop& stop) {
  if (!is_loaded_) load();
  write_new();
  const std::optional<Report> next = begin();
  if (!next) return false;
  std::optional<Report> ended;
  try {
    ended = make(*next, stop);
  } catch (const std::exception& e) {
    ended = *next;
    ended->state = State::failed;
    ended->sentence = e.what();
  }
  const fs::path folder = folder_of(*next);
  if (!ended) {
    Report again = *next;
    again.state = State::waiting;
    again.started_ms = 0;
    clear(folder);
    change(again);
    write(again);
    return true;
  }
  std::error_code ignored;  // leftovers are removed with the report
  fs::remove_all(folder / kScratch, ignored);
  // The segments contain the same data, and a record of days is large.
  fs::remove_all(folder / kRecords, ignored);
  ended->ended_ms = callbacks_.now_ms();
  ended->has_page = fs::exists(folder / page_of(ended->order.kind), ignored);
  change(*ended);
  write(*ended);
  remove_old(ended->order.loop);
  callbacks_.ended(*ended);
  return true;
}

std::vector<std::string> ReportQueue::arguments_for(const Report& report) const {
  const Order& order = report.order;
  const fs::path folder = folder_of(report);
  std::vector<std::string> words{to_text(order.kind),
                                 "--background",
                                 "--loop=" + order.loop,
                                 "--since=" + utc_text(order.from_ms),
                                 "--until=" + utc_text(order.to_ms),
                                 "--socket=" + settings_.socket.string()};
  if (order.kind == Kind::diagnose) {
    words.push_back("--report=" + (folder / page_of(order.kind)).string());
  } else if (order.kind == Kind::receipt) {
    words.push_back("--out=" + (folder / page_of(order.kind)).string());
  } else {
    words.push_back("--out=" + folder.string());
  }
  if (order.twin.empty()) return words;
  if (order.kind == Kind::gap || order.kind == Kind::receipt)
    words.push_back("--model=" + order.twin);
  if (order.kind == Kind::commission) words.push_back("--again=" + order.twin);
  return words;
}

std::optional<Report> ReportQueue::make(Report report, const Stop& stop) {
  const fs::path folder = folder_of(report);
  write(report);
  fs::create_directories(folder / kScratch);
  const base::File output(folder / kOutput, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND);
  if (!output.is_open()) {
    throw std::system_error(errno, std::generic_category(), (folder / kOutput).string());
  }
  const auto failed = [&report](std::string why) {
    report.state = State::failed;
    report.sentence = std::move(why);
    return report;
  };
  std::optional<base::ChildProcess> child(
      std::in_place, settings_.program.string(), arguments_for(report),
      base::ChildSettings{.output = output.fd(),
                          .environment = {"TMPDIR=" + (folder / kScratch).string()}});
  const auto deadline = Clock::now() + settings_.most_time;
  auto look = Clock::now() + kBetweenLooks;
  for (;;) {
    if (const std::optional<int> code = child->ended()) {
      std::string sentence = sentence_in(folder);
      if (*code != 0) {
        return failed(sentence.empty() ? fmt::format("loopwarden {} ended with {}",
                                                     to_text(report.order.kind), *code)
                                       : std::move(sentence));
      }
      if (!fs::exists(folder / page_of(report.order.kind))) return failed("it wrote no report");
      report.state = State::done;
      report.sentence = std::move(sentence);
      return report;
    }
    if (Clock::now() >= deadline) break;
    if (stop(kLook)) return std::nullopt;
    if (Clock::now() < look) continue;
    look = Clock::now() + kBetweenLooks;
    look_at_progress(report);
    write_new();
  }
  child.reset();
  clear(folder);
  return failed(
      fmt::format("Not done after {:.3g} min; a shorter stretch takes less.",
                  std::chrono::duration<double, std::ratio<60>>(settings_.most_time).count()));
}

void ReportQueue::look_at_progress(const Report& report) {
  const std::vector<std::string> lines = last_lines(folder_of(report) / kOutput);
  const auto last = std::find_if(lines.rbegin(), lines.rend(), is_progress);
  if (last == lines.rend()) return;
  Report now = report;
  take_progress(for_readers(*last, folder_of(report)), now);
  change(now);
}

void ReportQueue::remove_old(const std::string& loop) {
  std::vector<fs::path> old;
  {
    const std::lock_guard lock(mutex_);
    std::size_t kept = 0;
    for (auto e = all_.rbegin(); e != all_.rend(); ++e) {
      if (e->report.order.loop == loop && e->report.ended() && ++kept > settings_.kept) {
        old.push_back(folder_of(e->report));
      }
    }
  }
  for (const fs::path& folder : old) {
    if (callbacks_.in_use(folder)) continue;
    std::error_code error;
    fs::remove_all(folder, error);
    if (error) {
      spdlog::warn("report: {}: {}", folder.string(), error.message());
      continue;
    }
    const std::lock_guard lock(mutex_);
    std::erase_if(all_, [&](const Entry& e) { return folder_of(e.report) == folder; });
  }
}

}  // namespace loopwarden::daemon::reports
