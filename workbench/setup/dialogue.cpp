// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/dialogue.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/text.hpp"
#include "config/document.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/setup/questions.hpp"

namespace loopwarden::workbench::setup {

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
                     "is no question that a file may answer (what moves a valve is asked each "
                     "time)" +
                         config::suggestion(key.text, ids));
      } else if (value.kind != config::YamlNode::Kind::scalar) {
        report.error(value.place, key.text, "must be text on one line");
      } else if (const std::string why = question(key.text).wrong(value.text); !why.empty()) {
        report.error(value.place, key.text,
                     fmt::format("must be {} (got '{}')", why, config::quotable(value.text)));
      } else {
        answers[key.text] = {value.text, fmt::format("{}:{}", file, config::to_text(value.place))};
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
  if (const auto kept = state_.answers().find(id); kept != state_.answers().end()) {
    return kept->second;
  }
  const Question& asked = question(id);
  const std::string text = about + (about.empty() ? "" : ". ") + std::string(asked.text);
  std::string answer;
  if (const auto written = answers_.find(id); written != answers_.end()) {
    answer = written->second.text;
    say(fmt::format("{}: {}  ({})", text, answer, written->second.place));
  } else {
    const std::string offer = asked.fallback == nullptr ? "" : fmt::format(" [{}]", asked.fallback);
    answer = ask_now(text + offer, [&](const std::string& said) {
      return asked.wrong(said.empty() && asked.fallback != nullptr ? asked.fallback : said);
    });
    if (answer.empty() && asked.fallback != nullptr) answer = asked.fallback;
  }
  state_.answer(id, answer);
  return answer;
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

double Dialogue::number_now(const std::string& text) {
  const std::string answer = ask_now(text, [](const std::string& said) -> std::string {
    return numbers_in(said, 1) ? "" : "a number";
  });
  return numbers_in(answer, 1).value().front();
}

std::pair<double, double> Dialogue::range_now(const std::string& text) {
  const std::string answer = ask_now(text, [](const std::string& said) -> std::string {
    const auto ends = numbers_in(said, 2);
    return ends && (*ends)[0] < (*ends)[1] ? "" : "two numbers, the lower one first";
  });
  const std::vector<double> ends = numbers_in(answer, 2).value();
  return {ends[0], ends[1]};
}

}  // namespace loopwarden::workbench::setup
