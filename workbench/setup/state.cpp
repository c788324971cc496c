// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/state.hpp"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/clock.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/setup/questions.hpp"

namespace loopwarden::workbench::setup {
namespace {

CommandError not_written(const base::FileError& failed) {
  std::string text = failed.text();
  if (failed.error == EACCES) {
    text += ". Setup writes the daemon's configuration: run it as root, for example with sudo";
  }
  return {kExitIo, text};
}

}  // namespace

State::State(std::filesystem::path file) : file_(std::move(file)) {
  if (!std::filesystem::exists(file_)) {
    begun_ms_ = base::utc_ms();
    return;
  }
  const std::optional<std::string> text = base::read_file(file_);
  if (!text) throw CommandError(kExitIo, file_.string() + ": can't be read");
  try {
    const nlohmann::json all = nlohmann::json::parse(*text);
    all.at("answers").get_to(answers_);
    all.at("steps").get_to(steps_);
    all.at("found").get_to(found_);
    if (all.contains("earlier")) all.at("earlier").get_to(earlier_);
    if (all.contains("said")) all.at("said").get_to(said_);
    if (all.contains("begun_ms")) begun_ms_ = all.at("begun_ms").get<std::int64_t>();
  } catch (const nlohmann::json::exception&) {
    throw CommandError(kExitData, file_.string() +
                                      ": is no state of a setup; remove it to begin with the "
                                      "first question");
  }
  // The file may be of another version. Answers that are no longer valid are asked again.
  const std::vector<std::string> ids = question_ids();
  for (auto* answers : {&answers_, &earlier_}) {
    std::erase_if(*answers, [&](const auto& answer) {
      return std::find(ids.begin(), ids.end(), answer.first) == ids.end() ||
             !question(answer.first).wrong(answer.second).empty();
    });
  }
}

void State::answer(const std::string& id, const std::string& answer) {
  answers_[id] = answer;
  save();
}

void State::said(const std::string& id, const std::string& text) {
  said_.push_back(id);
  answer(id, text);
}

std::string State::take_back() {
  while (!said_.empty()) {
    std::string last = std::move(said_.back());
    said_.pop_back();
    if (!answers_.contains(last)) continue;
    forget_answer(last);
    return last;
  }
  return {};
}

std::string State::earlier(const std::string& id) const {
  const auto found = earlier_.find(id);
  return found == earlier_.end() ? "" : found->second;
}

void State::forget_answer(const std::string& id) {
  const auto kept = answers_.find(id);
  if (kept == answers_.end()) return;
  earlier_[id] = kept->second;
  answers_.erase(kept);
  save();
}

std::map<std::string, std::string> State::earlier_answers() const {
  if (earlier_.empty()) return {};
  std::map<std::string, std::string> all = answers_;
  for (const auto& [id, answer] : earlier_) all[id] = answer;
  return all;
}

std::string State::step(const std::string& name) const {
  const auto found = steps_.find(name);
  return found == steps_.end() ? "" : found->second;
}

void State::begin_step(const std::string& name) {
  now_at_ = name;
  now_at_since_ms_ = base::utc_ms();
  save();
}

void State::set_step(const std::string& name, const std::string& state) {
  steps_[name] = state;
  now_at_.clear();
  if (name == "file" && state == "done") {
    earlier_.clear();
    said_.clear();
  }
  save();
}

std::string State::found(const std::string& name) const {
  const auto found = found_.find(name);
  return found == found_.end() ? "" : found->second;
}

void State::set_found(const std::string& name, const std::string& what) {
  found_[name] = what;
  save();
}

void State::forget(const std::string& step) {
  steps_.erase(step);
  std::erase_if(answers_, [&](const auto& answer) {
    const bool is = answer.first != "tag" && question(answer.first).step == step;
    if (is && answer.first != "write") earlier_[answer.first] = answer.second;
    return is;
  });
  if (step == "record" || step == "commission") {
    steps_.erase("commission");
    found_.erase("commission");
  }
  if (step == "loop" || step == "devices" || step == "file") {
    steps_.erase("file");
    steps_.erase("start");
    answers_.erase("write");
    // A state with a step no longer counts as new.
    if (steps_.empty()) steps_[step] = "left";
  }
  save();
}

void State::file_changed() {
  for (const char* step : {"watchdog", "stroke", "record", "commission"}) steps_.erase(step);
  for (const char* found : {"action", "record", "commission"}) found_.erase(found);
  save();
}

void State::save() {
  std::error_code error;
  std::filesystem::create_directories(file_.parent_path(), error);
  if (error) {
    throw not_written({.file = file_.parent_path(), .error = error.value()});
  }
  nlohmann::json all = {{"answers", answers_}, {"steps", steps_}, {"found", found_}};
  if (!earlier_.empty()) all["earlier"] = earlier_;
  if (!said_.empty()) all["said"] = said_;
  if (begun_ms_) all["begun_ms"] = *begun_ms_;
  if (!now_at_.empty()) {
    all["now_at"] = now_at_;
    all["now_at_since_ms"] = now_at_since_ms_;
  }
  base::File held;
  // The daemon runs as another user and reads it. Like the loops' files, it contains no secret.
  constexpr unsigned kReadByAll = 0644;
  const auto lock = [&held](int fd) {
    held = base::File(::fcntl(fd, F_DUPFD_CLOEXEC, 0));
    struct flock writing {};
    writing.l_type = F_WRLCK;
    writing.l_whence = SEEK_SET;
    // If this fails, the page shows no step as running.
    ::fcntl(held.fd(), F_OFD_SETLK, &writing);
  };
  if (const auto failed = base::replace_file(
          file_, all.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n",
          {.mode = kReadByAll, .prepare = lock})) {
    throw not_written(*failed);
  }
  held_ = std::move(held);
}

}  // namespace loopwarden::workbench::setup
