// SPDX-License-Identifier: Apache-2.0
// How far a setup has come: a JSON file that each answer and each step is kept in, so that it goes on after whatever ended
// it. The daemon reads it for the page (daemon/console/setups.hpp).
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
  // Of the file, or of a setup that begins. Throws CommandError where it can't be read as such.
  explicit State(std::filesystem::path file);

  const std::map<std::string, std::string>& answers() const noexcept { return answers_; }
  void answer(const std::string& id, const std::string& answer);
  // The same of an answer that he gave just now: the way back leads there.
  void said(const std::string& id, const std::string& answer);
  // Forgets the answer that was given last and returns its question; empty: there is none. After
  // the file is written there is no way back.
  std::string take_back();
  // An answer that was forgotten, to be offered; empty: there is none.
  std::string earlier(const std::string& id) const;
  // The next time it is asked anew, and offered.
  void forget_answer(const std::string& id);
  // As they were before what is asked anew; empty: nothing is.
  std::map<std::string, std::string> earlier_answers() const;
  // done, left, or empty: not yet.
  std::string step(const std::string& name) const;
  void begin_step(const std::string& name);
  void set_step(const std::string& name, const std::string& state);
  // What a step found, for a later one and for people.
  std::string found(const std::string& name) const;
  void set_found(const std::string& name, const std::string& what);
  // A step that is to be done again asks its questions anew; what comes of them is written and looked at anew as well.
  void forget(const std::string& step);
  // The loop's file is another one: what was shown with the one before is to be shown anew.
  void file_changed();

  bool is_new() const noexcept { return steps_.empty(); }
  const std::filesystem::path& file() const noexcept { return file_; }

 private:
  void save();

  std::filesystem::path file_;
  // Holds a lock for writing on the file, which tells that a setup is at it and ends with the process.
  base::File held_;
  std::optional<std::int64_t> begun_ms_;  // UTC
  std::int64_t now_at_since_ms_ = 0;      // UTC
  std::string now_at_;                    // step; empty: none
  std::map<std::string, std::string> answers_, steps_, found_;
  std::map<std::string, std::string> earlier_;  // answers that were forgotten
  std::vector<std::string> said_;               // questions in the order in which he answered
};

}  // namespace loopwarden::workbench::setup
