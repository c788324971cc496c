// SPDX-License-Identifier: Apache-2.0
// The dialogue with the person who sets up a loop.
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

// The person, who uses a terminal or is simulated by a test.
class Person {
 public:
  virtual ~Person() = default;
  virtual void say(const std::string& text) = 0;  // prints a text and a line end
  // Returns the answer without leading and trailing blanks; nullopt: the person ended the input.
  virtual std::optional<std::string> line(const std::string& prompt) = 0;
  // Returns whether the person uses a terminal. Moving a valve requires a key that can abort.
  virtual bool has_keys() const = 0;
  // Turns on the reading of single keys.
  virtual void watch_keys(bool on) = 0;
  virtual std::optional<char> key(std::chrono::milliseconds patience) = 0;
};

// The person ended the dialogue. All answers are kept.
class Paused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The person returned to the previous question, whose answer is discarded.
struct Back {
  std::string question;
};
inline constexpr const char* kBack = "back";

// Answers from a file. Each has its place in the file, for messages.
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

  // Returns the answer to a question: the kept one, the one of the file, or one that the person
  // enters now. `about` is printed before the question. Throws CommandError if the file's answer is
  // wrong, Paused, Back.
  std::string ask(const std::string& id, const std::string& about = {});
  // Does the same for a question that needs an explicit answer each time: Enter is no answer.
  std::string ask_in_words(const std::string& id);
  // Returns why the configuration files would refuse the answer to a question; empty: they accept
  // it. Such an answer is refused when the person enters it.
  using Refusal = std::function<std::string(const std::string& id, const std::string& answer)>;
  void check_by(Refusal refusal) { refusal_ = std::move(refusal); }
  std::string why_refused(const std::string& id, const std::string& answer) const {
    return refusal_ ? refusal_(id, answer) : std::string();
  }
  // Returns whether a question has an answer, here or in the file.
  bool knows(const std::string& id) const {
    return state_.answers().contains(id) || answers_.contains(id);
  }
  // Discards an answer. The person is asked again, with the earlier answer as the default. The
  // answer in the file of answers is ignored.
  void forget(const std::string& id);
  // Asks a question whose answer is a number.
  double number(const std::string& id, const std::string& about = {});
  std::pair<double, double> range(const std::string& id);
  // Discards the previous answer and throws Back to repeat its question. Returns if there is no
  // such question.
  void back();
  // Asks the person each time, without the file and the kept answers. Repeats the question until
  // `wrong` returns an empty text.
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
  // `unit`: may follow the numbers in the answer.
  double number_now(const std::string& text, const std::string& unit = {});
  std::pair<double, double> range_now(const std::string& text, const std::string& unit = {});

  void say(const std::string& text) { person_.say(text); }
  Person& person() noexcept { return person_; }
  State& state() noexcept { return state_; }

 private:
  std::string line(const std::string& prompt);
  std::string ask(const std::string& id, const std::string& about, bool offers);

  Person& person_;
  Answers answers_;
  State& state_;
  Refusal refusal_;
};

}  // namespace loopwarden::workbench::setup
