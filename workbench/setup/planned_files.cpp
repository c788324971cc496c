// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/planned_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "config/link_address.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/loop_text.hpp"
#include "workbench/setup/questions.hpp"

namespace loopwarden::workbench::setup {
namespace {

namespace fs = std::filesystem;

// Returns a value that causes no error, for a question without an answer yet.
std::string sample(const std::string& id, const Answered& of) {
  static const std::map<std::string, std::string> kSamples{
      {"tag", "FIC-101"},
      {"control", "here"},
      {"pv.unit", "-"},
      {"pv.range", "0 100"},
      {"co.unit", "-"},
      {"co.range", "0 100"},
      {"sample_time", "0.2"},
      {"link.transport", "tcp"},
      {"link.host", "192.0.2.1"},  // of no device (RFC 5737)
      {"link.port", "502"},
      {"link.device", "/dev/null"},
      {"link.baud", "115200"},
      {"link.parity", "even"},
      {"link.stop_bits", "1"},
      {"pv.register", "247 input 65000 f32"},
      {"co.register", "247 holding 65000 f32"},
      {"mode.automatic", "1"},
      {"comm_loss", "none"},
      {"comm_loss.timeout", "60"},
      {"comm_loss.register", "247 holding 65010 u16"},
      {"kc", "0.2"},
      {"ti", "10"},
      {"stop.end", "hold"},
      {"stop.bad_pv", "hold"},
      {"stop.output_lost", "hold"}};
  if (id == "sp.limits") return of("pv.range");
  if (id == "co.limits") return of("co.range");
  const auto found = kSamples.find(id);
  return found == kSamples.end() ? "" : found->second;
}

Answered with_samples(const AnswerMap& answers) {
  return [&answers](const char* id) {
    const auto found = answers.find(id);
    return found != answers.end() ? found->second : sample(id, with_samples(answers));
  };
}

config::DaemonConfig daemon_of(const fs::path& file, const std::string& text) {
  // The file may be missing. An existing file must not be empty.
  if (!fs::exists(file)) return {};
  auto daemon = config::read_daemon_text(file.string(), text);
  if (!daemon) {
    throw CommandError(kExitConfiguration,
                       std::string(base::trimmed(config::to_text(daemon.diagnostics))));
  }
  return std::move(*daemon);
}

config::Loaded<config::DaemonConfig> read_link(const std::string& link) {
  return config::read_daemon_text("link", "links:\n  setup: " + link + "\n");
}

hal::modbus::LinkSettings settings_of(const std::string& link) {
  const auto read = read_link(link);
  if (!read) throw TestAborted(std::string(base::trimmed(config::to_text(read.diagnostics))));
  return read->links.at("setup");
}

// Returns the link that reaches the same device or line, in any name and spelling.
const hal::modbus::LinkSettings* known_link(const config::DaemonConfig& daemon,
                                            const hal::modbus::LinkSettings& wanted) {
  for (const auto& [name, settings] : daemon.links) {
    if (settings.transport == wanted.transport &&
        config::device_of(settings) == config::device_of(wanted)) {
      return &settings;
    }
  }
  return nullptr;
}

std::string free_name(const config::DaemonConfig& daemon, const std::string& tag) {
  const std::string first = base::lower_case(tag);
  std::string name = first;
  for (int i = 2; daemon.links.contains(name); ++i) name = fmt::format("{}-{}", first, i);
  return name;
}

// Returns the answers up to and including this question.
AnswerMap answers_to(const AnswerMap& all, const std::string& id) {
  AnswerMap part;
  for (const std::string& one : question_ids()) {
    if (const auto found = all.find(one); found != all.end()) part.insert(*found);
    if (one == id) break;
  }
  return part;
}

// Returns the reader's errors for the files that these answers produce.
std::set<std::string> errors_of(const Setup& setup, const AnswerMap& answers) {
  std::set<std::string> errors;
  const auto add = [&](const std::vector<config::Diagnostic>& diagnostics) {
    for (const config::Diagnostic& d : diagnostics) {
      if (d.level != config::Diagnostic::Level::error) continue;
      errors.insert(d.key.empty() ? d.message : d.key + ": " + d.message);
    }
  };
  add(read_link(link_text(with_samples(answers))).diagnostics);
  if (!errors.empty()) return errors;
  const Answered of = with_samples(answers);
  if (of("control") == "here" &&
      register_in(of("co.register")).value_or(RegisterPlace{}).table != "holding") {
    return {
        "CO is written to this register, and an input register can only be read. Name a "
        "holding register, such as 1 holding 0 f32"};
  }
  add(config::read_configuration(setup.folder, drafts_of(setup, planned_files(setup, answers)))
          .diagnostics);
  return errors;
}

bool makes_files(const AnswerMap& answers) {
  const auto source = answers.find("source");
  return answers.contains("control") && (source == answers.end() || source->second != "opcua");
}

// Checks all answers at once.
bool is_taken(const Setup& setup, const AnswerMap& answers) {
  try {
    return !makes_files(answers) || errors_of(setup, answers).empty();
  } catch (const std::runtime_error&) {
    return false;
  }
}

std::string why_refused(const Setup& setup, AnswerMap answers, const std::string& id) {
  if (!makes_files(answers)) return {};
  try {
    const std::set<std::string> with = errors_of(setup, answers);
    if (with.empty()) return {};
    answers.erase(id);
    const std::set<std::string> without = errors_of(setup, answers);
    const auto own = std::find_if(with.begin(), with.end(),
                                  [&](const auto& error) { return !without.contains(error); });
    return own == with.end() ? "" : *own;
  } catch (const TestAborted&) {
    return {};  // the step `file` reports it
  } catch (const CommandError&) {
    return {};
  }
}

}  // namespace

PlannedFiles planned_files(const Setup& setup, const AnswerMap& answers) {
  const Answered of = with_samples(answers);
  const fs::path file = setup.folder / "loopwardend.yaml";
  const std::string text = text_of_file(file);
  const config::DaemonConfig daemon = daemon_of(file, text);
  PlannedFiles planned{
      .loop = {}, .link_name = {}, .link = link_text(of), .other_settings = {}, .daemon = {}};
  hal::modbus::LinkSettings wanted = settings_of(planned.link);
  if (const auto* known = known_link(daemon, wanted)) {
    planned.link_name = known->name;
    wanted.name = known->name;
    if (known->transport == hal::modbus::Transport::rtu &&
        (wanted.baud != known->baud || wanted.parity != known->parity ||
         wanted.stop_bits != known->stop_bits)) {
      planned.other_settings = fmt::format("{} baud, {} stop bits", known->baud, known->stop_bits);
    }
  } else {
    planned.link_name = free_name(daemon, setup.tag);
    std::optional<std::string> with = with_link(text, planned.link_name, planned.link);
    if (!with) {
      throw TestAborted(fmt::format("{}: its links are on one line; add there: {}: {}",
                                    file.string(), planned.link_name, planned.link));
    }
    planned.daemon = std::move(*with);
  }
  planned.loop = loop_text(of, planned.link_name);
  return planned;
}

config::Drafts drafts_of(const Setup& setup, const PlannedFiles& planned) {
  config::Drafts drafts{{setup.loop_file(), planned.loop}};
  if (!planned.daemon.empty()) drafts[setup.folder / "loopwardend.yaml"] = planned.daemon;
  return drafts;
}

std::string why_refused(const Setup& setup, const std::string& id, const std::string& answer) {
  AnswerMap answers = setup.state().answers();
  answers[id] = answer;
  return why_refused(setup, answers_to(answers, id), id);
}

std::string refused_answer(const Setup& setup) {
  const AnswerMap& all = setup.state().answers();
  if (is_taken(setup, all)) return {};
  for (const std::string& id : question_ids()) {
    if (all.contains(id) && !why_refused(setup, answers_to(all, id), id).empty()) return id;
  }
  return {};
}

}  // namespace loopwarden::workbench::setup
