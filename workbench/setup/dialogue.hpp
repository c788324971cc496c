// SPDX-License-Identifier: Apache-2.0
// The talk with the person who sets a loop up.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "workbench/setup/questions.hpp"
#include "workbench/setup/state.hpp"

namespace loopwarden::workbench::setup {

// The person, at a terminal or in a test.
class Person {
 public:
  virtual ~Person() = default;
  virtual void say(const std::string& text) = 0;  // with a line's end
  // Without the blanks at both ends; nullopt: he has gone.
  virtual std::optional<std::string> line(const std::string& prompt) = 0;
  // Whether he sits at a terminal: only who can press a key moves a valve.
  virtual bool has_keys() const = 0;
  // Keys count as they are pressed while this is on.
  virtual void watch_keys(bool on) = 0;
  virtual std::optional<char> key(std::chrono::milliseconds patience) = 0;
};

// He has gone; what was answered is kept.
class Paused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// He wants the question before: its answer is no longer kept.
struct Back {
  std::string question;
};
inline constexpr const char* kBack = "back";

// Answers that were written down before. Each knows where it stands, for messages.
struct WrittenAnswer {
  std::string text, place;
};
using Answers = std::map<std::string, WrittenAnswer>;
// Throws CommandError with every key that is wrong.
Answers read_answers(const std::string& file);

class Dialogue {
 public:
  Dialogue(Person& person, Answers answers, State& state)
      : person_(person), answers_(std::move(answers)), state_(state) {}

  // The answer to a question: as kept, as written in the file, or as he says now. `about` stands before the question's
  // text. Throws CommandError where the file's is wrong, Paused, Back.
  std::string ask(const std::string& id, const std::string& about = {});
  // The same of a question that is answered in words each time: Enter is no answer.
  std::string ask_in_words(const std::string& id);
  // What the files would refuse is refused when it is said: why, of a question and an answer;
  // empty: nothing is wrong.
  using Refusal = std::function<std::string(const std::string& id, const std::string& answer)>;
  void check_by(Refusal refusal) { refusal_ = std::move(refusal); }
  std::string why_refused(const std::string& id, const std::string& answer) const {
    return refusal_ ? refusal_(id, answer) : std::string();
  }
  // Whether a question is answered already, or in the file.
  bool knows(const std::string& id) const {
    return state_.answers().contains(id) || answers_.contains(id);
  }
  // Asked anew, of him, with what was answered as the offer; not what is written in the file of
  // answers.
  void forget(const std::string& id);
  // Of a question whose answer is numbers.
  double number(const std::string& id, const std::string& about = {});
  std::pair<double, double> range(const std::string& id);
  // Asks the question before once more. Returns where there is none. Throws Back.
  void back();
  // Of him alone, each time; until `wrong` says nothing.
  template <class Wrong>
  std::string ask_now(const std::string& text, Wrong wrong) {
    for (;;) {
      std::string answer = line(text + ": ");
      const std::string why = wrong(answer);
      if (why.empty()) return answer;
      say("  " + why);
    }
  }
  std::string ask_now(const std::string& text);
  bool yes_now(const std::string& text);
  // `unit`: may stand behind the numbers.
  double number_now(const std::string& text, const std::string& unit = {});
  std::pair<double, double> range_now(const std::string& text, const std::string& unit = {});

  void say(const std::string& text) { person_.say(text); }
  Person& person() noexcept { return person_; }
  State& state() noexcept { return state_; }

 private:
  std::string line(const std::string& prompt);
  std::string ask(const std::string& id, const std::string& about, bool offers);
  std::string why_wrong(const Question& asked, const std::string& answer) const;

  Person& person_;
  Answers answers_;
  State& state_;
  Refusal refusal_;
};

}  // namespace loopwarden::workbench::setup
