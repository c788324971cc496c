// SPDX-License-Identifier: Apache-2.0
// Writes the loop's file and its link, after the reader of `check` has accepted them.
#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "config/validation/validation.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/live/test_bench.hpp"
#include "workbench/setup/planned_files.hpp"
#include "workbench/setup/questions.hpp"
#include "workbench/setup/setup.hpp"
#include "workbench/text/line_merge.hpp"

namespace loopwarden::workbench::setup {
namespace {

namespace fs = std::filesystem;

void ask_all(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  for (const char* id : {"pv.follows", "kc", "ti", "sp.limits", "co.limits", "co.rate"})
    dialogue.ask(id);
  dialogue.say("  What the output does when something fails, in " + dialogue.ask("co.unit") +
               " or hold:");
  for (const char* id : {"stop.end", "stop.bad_pv", "stop.output_lost"}) dialogue.ask(id);
}

// Discards kept answers that the files would refuse now, so that they are asked again.
void forget_refused(Setup& setup) {
  for (std::string id; !(id = refused_answer(setup)).empty();) {
    if (question(id).step != "file") return;
    setup.state().forget_answer(id);
  }
}

// Returns the text that setup wrote last; empty: setup did not write this file, or the text is
// unknown.
std::string written_before(const Setup& setup) {
  if (std::string written = setup.state().found("written"); !written.empty()) return written;
  const AnswerMap answers = setup.state().earlier_answers();
  if (!answers.contains("pv.register")) return {};
  try {
    return planned_files(setup, answers).loop;
  } catch (const std::exception&) {
    return {};
  }
}

std::string in_lines(const std::vector<std::string>& lines, const char* before) {
  std::string text;
  for (const std::string& line : lines) text += before + line + "\n";
  return text;
}

// Returns the existing file with the changes of the answers. All lines that setup did not write
// stay. Throws TestAborted if such lines would be replaced and no person can confirm it.
std::string changed_file(Setup& setup, const std::string& live, const std::string& wanted) {
  Dialogue& dialogue = setup.dialogue;
  std::string base = written_before(setup);
  if (base.empty()) base = common_lines(live, wanted);
  const LineMerge merged = merge_lines(base, live, wanted);
  if (merged.conflicts.empty()) return merged.with_mine;
  const std::string file = setup.loop_file().string();
  std::string lines;
  for (const LineConflict& one : merged.conflicts) {
    lines += in_lines(one.mine, "- ") + in_lines(one.other, "+ ") + "  ...\n";
  }
  dialogue.say(
      fmt::format("  {} has lines (-) that setup did not write; by the answers they would "
                  "be (+):\n{}",
                  file, lines));
  if (!dialogue.person().has_keys()) {
    throw TestAborted(
        fmt::format("lines of {} that setup did not write are replaced at a terminal "
                    "only. The file was not changed.",
                    file));
  }
  return dialogue.yes_now("  Replace them") ? merged.with_other : merged.with_mine;
}

// Ends the step. The answer that caused the error is asked again.
[[noreturn]] void refuse(Setup& setup) {
  const std::string id = refused_answer(setup);
  if (!id.empty()) {
    setup.state().forget_answer(id);
    setup.state().set_step(std::string(question(id).step), "");
  }
  throw TestAborted(
      id.empty()
          ? fmt::format(
                "the files would be invalid and were not written. {} asks for the loop again; "
                "--again devices and --again file ask the other questions again",
                setup.command("loop"))
          : fmt::format("the files would be invalid and were not written. {} is asked again", id));
}

}  // namespace

bool would_be_read(Setup& setup, const config::Drafts& drafts) {
  const auto read = config::validate_all(setup.folder, drafts);
  const std::string told = config::to_text(read.diagnostics);
  if (!told.empty()) setup.dialogue.say(std::string(base::trimmed(told)));
  return read.value.has_value();
}

Outcome write_files(Setup& setup) {
  Dialogue& dialogue = setup.dialogue;
  if (setup.elsewhere() && dialogue.ask("source") == "opcua") return Outcome::not_needed;
  forget_refused(setup);
  if (!setup.elsewhere()) ask_all(setup);
  const PlannedFiles planned = planned_files(setup, setup.state().answers());
  const fs::path file = setup.loop_file();
  const std::string live = text_of_file(file);
  const std::string loop = live.empty() ? planned.loop : changed_file(setup, live, planned.loop);
  const std::string changes = live.empty() ? "" : changed_lines(live, loop);
  config::Drafts drafts = drafts_of(setup, planned);
  drafts[file] = loop;
  if (!live.empty() && changes.empty()) drafts.erase(file);
  if (!planned.daemon.empty()) {
    dialogue.say(fmt::format("{}, links:\n  {}: {}", (setup.folder / "loopwardend.yaml").string(),
                             planned.link_name, planned.link));
  } else {
    dialogue.say(fmt::format(
        "  Link {} of loopwardend.yaml reaches it{}{}.", planned.link_name,
        planned.other_settings.empty() ? "" : ", with its own settings: ", planned.other_settings));
  }
  if (live.empty()) {
    dialogue.say(fmt::format("{}:\n{}", file.string(), loop));
  } else {
    dialogue.say(changes.empty() ? fmt::format("{} stays as it is.", file.string())
                                 : fmt::format("{} changes:\n{}", file.string(), changes));
  }
  if (!would_be_read(setup, drafts)) refuse(setup);
  if (!drafts.empty()) {
    const std::string write = live.empty() ? dialogue.ask("write") : dialogue.ask_in_words("write");
    if (write != "yes") {
      setup.state().forget("file");
      return Outcome::left;
    }
    OutputFiles files;
    files.make_folder(setup.folder / "loops.d");
    // The link precedes the loop that names it.
    if (!planned.daemon.empty()) files.add(setup.folder / "loopwardend.yaml", planned.daemon);
    if (drafts.contains(file)) files.add(file, loop);
    files.commit();
  }
  setup.state().set_found("written", planned.loop);
  if (!changes.empty()) setup.state().file_changed();
  return Outcome::done;
}

}  // namespace loopwarden::workbench::setup
