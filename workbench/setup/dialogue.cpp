// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/dialogue.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/text.hpp"
#include "config/document.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/setup/questions.hpp"

namespace loopwarden::workbench::setup {
namespace {

// Returns the unit of a question's numbers; empty if it has no unit or the unit is unknown.
// `answer`: returns the answer to another question, if there is one.
template <class AnswerTo>
std::string unit_of(const Question& asked, AnswerTo answer) {
  if (asked.unit == nullptr) return {};
  std::string unit = asked.unit;
  if (unit == "s") return unit;
  const std::string known = answer(unit == "pv" ? "pv.unit" : "co.unit");
  return known.empty() ? known : known + (unit == "co/s" ? "/s" : "");
}

// Returns the expected form of a number, for an answer in another form.
std::string number_form(const std::string& unit) {
  const std::string also = unit.empty() ? "" : fmt::format(" or 10.5 {}", unit);
  return fmt::format("such as 10.5{} (decimal point{})", also,
                     unit.empty() ? "" : ", no other unit");
}

// Returns the document's text for a key; empty if the key is missing.
std::string text_at(const config::YamlNode& root, std::string_view key) {
  for (std::size_t i = 0; i < root.keys.size(); ++i) {
    if (root.keys[i].text == key) return root.values[i].text;
  }
  return {};
}

}  // namespace

Answers read_answers(const std::string& file) {
  config::Report report(file);
  Answers answers;
  const std::optional<std::string> text = config::read_source_file(file, report);
  const std::optional<config::YamlNode> root =
      text ? config::parse_yaml(*text, report) : std::nullopt;
  const std::vector<std::string> ids = question_ids();
  if (root && root->kind != config::YamlNode::Kind::map) {
    report.error(root->place, "", "must be answers, one `question: answer` a line");
  } else if (root) {
    for (std::size_t i = 0; i < root->keys.size(); ++i) {
      const config::YamlNode& key = root->keys[i];
      const config::YamlNode& value = root->values[i];
      if (std::find(ids.begin(), ids.end(), key.text) == ids.end()) {
        report.error(key.place, key.text,
                     "is no question that a file may answer (questions that move a valve are asked "
                     "each time)" +
                         config::suggestion(key.text, ids));
      } else if (value.kind != config::YamlNode::Kind::scalar) {
        report.error(value.place, key.text, "must be text on one line");
      } else {
        const Question& asked = question(key.text);
        const std::string unit =
            unit_of(asked, [&](std::string_view other) { return text_at(*root, other); });
        const std::string answer = without_unit(value.text, unit);
        if (const std::string why = asked.wrong(answer); !why.empty()) {
          report.error(value.place, key.text,
                       fmt::format("must be {} (got '{}')", why, config::quotable(value.text)));
        }
        answers[key.text] = {answer, fmt::format("{}:{}", file, config::to_text(value.place))};
      }
    }
  }
  if (report.has_errors()) {
    throw CommandError(kExitData, std::string(base::trimmed(config::to_text(report.take()))));
  }
  return answers;
}

std::string Dialogue::line(const std::string& prompt) {
  const std::optional<std::string> answer = person_.line(prompt);
  if (!answer) throw Paused("paused");
  return *answer;
}

std::string Dialogue::ask(const std::string& id, const std::string& about) {
  return ask(id, about, true);
}

std::string Dialogue::ask_in_words(const std::string& id) { return ask(id, {}, false); }

std::string Dialogue::ask(const std::string& id, const std::string& about, bool offers) {
  if (const auto kept = state_.answers().find(id); kept != state_.answers().end()) {
    return kept->second;
  }
  const Question& asked = question(id);
  const std::string unit = unit_of(asked, [&](const char* other) {
    const auto known = state_.answers().find(other);
    return known == state_.answers().end() ? std::string() : known->second;
  });
  const std::string text = about + (about.empty() ? "" : ". ") + std::string(asked.text);
  if (const auto written = answers_.find(id); written != answers_.end()) {
    const std::string& answer = written->second.text;
    say(fmt::format("{}: {}  ({})", text, answer, written->second.place));
    if (const std::string why = why_refused(id, answer); !why.empty()) {
      throw CommandError(kExitData, fmt::format("{}: {}: {}", written->second.place, id, why));
    }
    state_.answer(id, answer);
    return answer;
  }
  std::optional<std::string> offer;
  if (offers && asked.fallback != nullptr) offer = asked.fallback;
  if (const std::string earlier = state_.earlier(id); offers && !earlier.empty()) offer = earlier;
  const auto meant = [&](const std::string& said) {
    return said.empty() && offer ? *offer : without_unit(said, unit);
  };
  for (;;) {
    const std::string said =
        ask_now(text + (offer ? fmt::format(" [{}]", *offer) : ""), [&](const std::string& answer) {
          if (answer == kBack) return std::string();
          if (const std::string why = asked.wrong(meant(answer)); !why.empty()) {
            return unit.empty() ? why : fmt::format("{}; the only unit is {}", why, unit);
          }
          return why_refused(id, meant(answer));
        });
    if (said != kBack) {
      state_.said(id, meant(said));
      return meant(said);
    }
    back();
  }
}

void Dialogue::forget(const std::string& id) {
  state_.forget_answer(id);
  answers_.erase(id);
}

void Dialogue::back() {
  std::string last = state_.take_back();
  if (!last.empty()) throw Back{std::move(last)};
  say("  There is no earlier question. To repeat a step, press Ctrl-C and add --again STEP to the "
      "same command.");
}

double Dialogue::number(const std::string& id, const std::string& about) {
  return numbers_in(ask(id, about), 1).value().front();
}

std::pair<double, double> Dialogue::range(const std::string& id) {
  const std::vector<double> ends = numbers_in(ask(id), 2).value();
  return {ends[0], ends[1]};
}

std::string Dialogue::ask_now(const std::string& text) {
  return ask_now(text, [](const std::string&) { return std::string(); });
}

bool Dialogue::yes_now(const std::string& text) {
  return ask_now(text + " (yes or no)", [](const std::string& answer) -> std::string {
           return answer == "yes" || answer == "no" ? "" : "yes or no";
         }) == "yes";
}

double Dialogue::number_now(const std::string& text, const std::string& unit) {
  const std::string answer = ask_now(text, [&](const std::string& said) -> std::string {
    return numbers_in(without_unit(said, unit), 1) ? "" : "a number " + number_form(unit);
  });
  return numbers_in(without_unit(answer, unit), 1).value().front();
}

std::pair<double, double> Dialogue::range_now(const std::string& text, const std::string& unit) {
  const std::string answer = ask_now(text, [&](const std::string& said) -> std::string {
    const auto ends = numbers_in(without_unit(said, unit), 2);
    return ends && (*ends)[0] < (*ends)[1]
               ? ""
               : "two numbers, the lower one first, each " + number_form(unit);
  });
  const std::vector<double> ends = numbers_in(without_unit(answer, unit), 2).value();
  return {ends[0], ends[1]};
}

}  // namespace loopwarden::workbench::setup
