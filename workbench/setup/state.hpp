// SPDX-License-Identifier: Apache-2.0
// The progress of a setup in a JSON file. It keeps each answer and each step, so that the setup can
// continue after any interruption. The daemon reads the file for the page
// (daemon/console/setups.hpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/file.hpp"

namespace loopwarden::workbench::setup {

class State {
 public:
  // Opens the file, or starts a new setup. Throws CommandError if the file is not a valid state.
  explicit State(std::filesystem::path file);

  const std::map<std::string, std::string>& answers() const noexcept { return answers_; }
  void answer(const std::string& id, const std::string& answer);
  // Keeps an answer that the person gave just now. take_back() can discard it.
  void said(const std::string& id, const std::string& answer);
  // Discards the last given answer and returns its question; empty: there is no such answer. After
  // the files of the loop are written, answers can't be taken back.
  std::string take_back();
  // Returns a discarded answer, which is the default of the repeated question; empty: no such
  // answer.
  std::string earlier(const std::string& id) const;
  // Discards an answer. The question is asked again with the answer as the default.
  void forget_answer(const std::string& id);
  // Returns the earlier answers to the questions that are asked again; may be empty.
  std::map<std::string, std::string> earlier_answers() const;
  // Returns "done", "left", or an empty text if the step has not run yet.
  std::string step(const std::string& name) const;
  void begin_step(const std::string& name);
  void set_step(const std::string& name, const std::string& state);
  // Returns the result of a step, for a later step and for people.
  std::string found(const std::string& name) const;
  void set_found(const std::string& name, const std::string& what);
  // Discards a step: its questions are asked again, and its results are written and checked again.
  void forget(const std::string& step);
  // The loop's file has changed: results that were shown for the earlier file must be shown again.
  void file_changed();

  bool is_new() const noexcept { return steps_.empty(); }
  const std::filesystem::path& file() const noexcept { return file_; }

 private:
  void save();

  std::filesystem::path file_;
  // Holds a write lock on the file until the process ends. The lock shows that a setup is running.
  base::File held_;
  std::optional<std::int64_t> begun_ms_;  // UTC
  std::int64_t now_at_since_ms_ = 0;      // UTC
  std::string now_at_;                    // step; empty: no step is running
  std::map<std::string, std::string> answers_, steps_, found_;
  std::map<std::string, std::string> earlier_;  // discarded answers
  std::vector<std::string> said_;               // questions in the order of the answers
};

}  // namespace loopwarden::workbench::setup
