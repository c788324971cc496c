// SPDX-License-Identifier: Apache-2.0
// loopwarden discover: writes files of loops that another controller runs, from a plant's tags.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "base/child_process.hpp"
#include "base/file.hpp"
#include "base/text.hpp"
#include "config/config_reader.hpp"
#include "config/source_file.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/discover/found_loops.hpp"
#include "workbench/discover/loop_file.hpp"
#include "workbench/discover/tag_list.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/records/rules_file.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;

struct DiscoverCommand {
  std::string tags;
  std::string opcua;         // URL
  std::string sparkplug;     // group
  std::string opcua_config;  // empty: as loopwarden-opcua
  std::string feed_config = "/etc/loopwarden-feed/feed.yaml";
  int seconds = 60;  // of listening
  std::string rules;
  std::string feeder;
  std::optional<double> sample_time_s;
  std::string nodes;  // file
  std::string out;
  bool json = false;
};

bool is_there(const fs::path& path) {
  return fs::symlink_status(path).type() != fs::file_type::not_found;
}

constexpr std::chrono::milliseconds kLookAtChildEvery{20};

// A program that lists the tags of a source.
struct Browser {
  std::string program;
  std::string package;
  std::vector<std::string> words;
  std::string source;
};

std::optional<Browser> browser_of(const DiscoverCommand& options) {
  if (!options.opcua.empty()) {
    std::vector<std::string> words{"browse", "--url", options.opcua};
    if (!options.opcua_config.empty()) {
      words.insert(words.end(), {"--config", options.opcua_config});
    }
    return Browser{"loopwarden-opcua", "loopwarden-opcua", std::move(words), options.opcua};
  }
  if (options.sparkplug.empty()) return std::nullopt;
  return Browser{"loopwarden-feed",
                 "loopwarden",
                 {"--config", options.feed_config, "--browse", options.sparkplug, "--seconds",
                  std::to_string(options.seconds)},
                 "Sparkplug group " + options.sparkplug};
}

// Writes the list of tags to `list` and the program's messages to standard error. Returns its exit
// code.
int browse(const Browser& browser, const fs::path& list) {
  const base::File file(list, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (!file.is_open()) fail(kExitIo, "{}: can't be written", list.string());
  try {
    base::ChildProcess child(browser.program, browser.words,
                             {.output = file.fd(), .errors = STDERR_FILENO, .idle = false});
    std::optional<int> code;
    while (!(code = child.ended())) std::this_thread::sleep_for(kLookAtChildEvery);
    return *code;
  } catch (const std::system_error& e) {
    fail(kExitIo,
         "{}: {}. Install the package {} on this machine, or give a list of the tags with --tags",
         browser.program, e.code().message(), browser.package);
  }
}

std::vector<record::TagRule> rules_in(const std::string& path) {
  if (path.empty()) return {};
  auto rules = read_rules_file(path);
  if (!rules) fail(kExitConfiguration, "{}", base::trimmed(config::to_text(rules.diagnostics)));
  fmt::print(stderr, "{}", config::to_text(rules.diagnostics));
  return std::move(rules->rules);
}

// Writes the loops' files and collects one line of results per loop.
class LoopFiles {
 public:
  LoopFiles(const DiscoverCommand& options, OutputFiles& files, std::string source)
      : options_(options),
        files_(files),
        settings_{.feeder = options.feeder,
                  .source = std::move(source),
                  .sample_time_s = options.sample_time_s} {}

  void add(const discover::FoundLoop& loop) {
    const std::string& tag = loop.tag.value;
    nlohmann::json entry{{"tag", tag}};
    const discover::LoopFile made = discover::loop_file(loop, settings_);
    const fs::path complete = fs::path(options_.out) / (tag + ".yaml");
    const fs::path path =
        made.is_complete() ? complete : fs::path(complete.string() + ".incomplete");
    if (!tags_.insert(base::lower_case(tag)).second) {
      leave(entry,
            fmt::format(
                "{}: another loop has this tag. Separate them with a rule with `loop` (--rules)",
                tag));
    } else if (tag.empty() || tag.size() > kLongestTag) {
      leave(entry,
            fmt::format(
                "{}: has no tag of 1 to {} letters. Set one with a rule with `loop` (--rules)",
                base::in_quotes(loop.signal(record::Role::pv)->name), kLongestTag));
    } else if (is_there(complete) || is_there(path)) {
      const fs::path there = is_there(complete) ? complete : path;
      leave(entry, there.string() + ": exists; not changed. Remove it to write it again");
    } else {
      write(path, made, entry);
    }
    loops_.push_back(std::move(entry));
  }
  std::size_t written() const noexcept { return written_; }
  bool any_incomplete() const noexcept { return any_incomplete_; }
  nlohmann::json take_json() { return std::move(loops_); }

 private:
  static constexpr std::size_t kLongestTag = 32;

  void leave(nlohmann::json& entry, const std::string& why) const {
    entry["left"] = why;
    if (!options_.json) fmt::print("{}\n", why);
  }
  void write(const fs::path& path, const discover::LoopFile& made, nlohmann::json& entry) {
    files_.add(path, made.text);
    ++written_;
    entry["file"] = path.string();
    entry["sure"] = made.sure;
    entry["guessed"] = nlohmann::json::object();
    std::string guesses;
    for (const auto& [key, why] : made.guessed) {
      entry["guessed"][key] = why;
      guesses += (guesses.empty() ? "; guessed: " : ", ") + key;
    }
    entry["missing"] = made.missing;
    any_incomplete_ = any_incomplete_ || !made.is_complete();
    if (options_.json) return;
    fmt::print("{}: sure: {}{}{}{}\n", path.string(), fmt::join(made.sure, ", "), guesses,
               made.is_complete() ? "" : "; missing: ", fmt::join(made.missing, ", "));
  }

  const DiscoverCommand& options_;
  OutputFiles& files_;
  discover::LoopFileSettings settings_;
  std::set<std::string> tags_;
  nlohmann::json loops_ = nlohmann::json::array();
  std::size_t written_ = 0;
  bool any_incomplete_ = false;
};

// Returns the action after the files are written, as the end of a sentence.
std::string next_step(const DiscoverCommand& options, const LoopFiles& loops,
                      const discover::FoundLoops& found) {
  if (found.loops.empty()) {
    return ". No tags are PV and CO of one loop: name them with --rules "
           "(docs/reference/import-formats.md)";
  }
  if (loops.written() == 0) return "";
  std::string text = ". Check the guessed keys, ";
  if (loops.any_incomplete())
    text += "add the missing keys to each file .incomplete and remove this ending, ";
  const fs::path out = (fs::absolute(options.out) / "").lexically_normal().parent_path();
  return out.filename() == "loops.d"
             ? text + fmt::format("then run `loopwarden check {}`",
                                  base::as_shell_word(out.parent_path().string()))
             : text + "then move the files to the folder loops.d of the daemon's configuration";
}

// Returns a note if loopwardend.yaml next to the folder does not name the feeder; empty if it does.
std::string feeder_text(const DiscoverCommand& options) {
  const std::string path =
      (fs::absolute(options.out) / ".." / "loopwardend.yaml").lexically_normal().string();
  config::Report report(path);
  const std::optional<std::string> text = config::read_source_file(path, report);
  if (text) {
    const auto daemon = config::read_daemon_text(path, *text);
    if (daemon && daemon->feeders.contains(options.feeder)) return {};
  }
  return fmt::format(
      "Add this line to {}: feeders: {{{}: {{user: USER}}}} (USER runs the program that brings the "
      "values, for example loopwarden-{})\n",
      path, options.feeder, options.sparkplug.empty() ? "opcua" : "feed");
}

void print_rest(const discover::FoundLoops& found) {
  for (const std::string& what : found.incomplete) {
    fmt::print(stderr, "{}, so it is no loop. If it is one, assign the missing tag with --rules\n",
               what);
  }
  for (const std::string& rule : found.idle_rules) fmt::print(stderr, "{}\n", rule);
  if (found.other_names.empty()) return;
  constexpr std::size_t kMost = 6;
  const std::size_t shown = std::min(kMost, found.other_names.size());
  std::string names;
  for (std::size_t k = 0; k < shown; ++k)
    names += (k > 0 ? ", " : "") + base::in_quotes(found.other_names[k]);
  fmt::print(stderr, "{} {} to no loop: {}{}. Assign {} with --rules\n", found.other_names.size(),
             found.other_names.size() == 1 ? "tag belongs" : "tags belong", names,
             found.other_names.size() > shown ? ", ..." : "",
             found.other_names.size() == 1 ? "it" : "them");
}

int run_discover(const DiscoverCommand& given) {
  DiscoverCommand options = given;
  const std::optional<Browser> browser = browser_of(options);
  if (browser.has_value() == !options.tags.empty()) {
    require("one of --tags, --opcua and --sparkplug");
  }
  const bool sparkplug = !options.sparkplug.empty();
  if (options.feeder.empty()) options.feeder = sparkplug ? "mqtt" : "opcua";
  if (!options.nodes.empty() && is_there(options.nodes))
    fail(kExitData, "{}: exists; not changed. Use another name for --nodes", options.nodes);
  const std::vector<record::TagRule> rules = rules_in(options.rules);
  OutputFiles files({options.tags, options.rules});
  fs::path list = options.tags;
  OutputFiles scratch;
  if (browser) {
    list = scratch.stage(scratch.make_scratch_folder() / "tags.csv");
    if (const int code = browse(*browser, list); code != 0) {
      fmt::print(stderr,
                 "{} has listed no tags of {} (exit code {}). Correct the cause above, or give a "
                 "list of the tags with --tags\n",
                 browser->program, browser->source, code);
      return code;
    }
  }
  const std::string source = browser ? browser->source : options.tags;
  const discover::TagList tags = discover::read_tag_file(list, source);
  for (const std::string& note : tags.notes) fmt::print(stderr, "{}\n", note);
  const discover::FoundLoops found = discover::find_loops(tags.tags, rules);
  const std::string nodes = discover::node_list(
      found.loops, sparkplug ? discover::NodeForm::sparkplug : discover::NodeForm::opcua);
  if (!options.nodes.empty() && nodes.empty()) {
    fail(kExitData,
         "{}: no loop's tag has a node. Add a column node to the list, or leave out --nodes",
         source);
  }
  files.make_folder(options.out);
  LoopFiles loops(options, files, source);
  for (const discover::FoundLoop& loop : found.loops) loops.add(loop);
  const std::size_t written = loops.written();
  if (!options.nodes.empty()) files.add(options.nodes, nodes);
  if (written > 0 || !options.nodes.empty()) files.commit();
  if (options.json) {
    show_json({{"loops", loops.take_json()},
               {"not_whole", found.incomplete},
               {"not_used", found.other_names}});
  }
  std::fflush(stdout);
  print_rest(found);
  if (written > 0) fmt::print(stderr, "{}", feeder_text(options));
  fmt::print(stderr, "{} of {} loops written{}\n", written, found.loops.size(),
             next_step(options, loops, found));
  return written > 0 ? kExitOk : kExitData;
}

}  // namespace

void add_discover(Program& program) {
  auto [command, o] = program.command(
      "discover", "Write files of loops that another controller runs, from the plant's tags",
      run_discover);
  const Option tags =
      command.option("--tags", o.tags,
                     "list of tags, CSV or a sheet: columns tag or name, node, unit, low, high, "
                     "description, in any order");
  const Option opcua =
      command
          .option("--opcua", o.opcua,
                  "OPC UA server, opc.tcp://HOST:PORT, whose tags loopwarden-opcua lists")
          .excludes(tags);
  command
      .option(
          "--opcua-config", o.opcua_config,
          "opcua.yaml of loopwarden-opcua: user, certificates [/etc/loopwarden-opcua/opcua.yaml]")
      .needs(opcua);
  const Option sparkplug =
      command
          .option("--sparkplug", o.sparkplug,
                  "Sparkplug group whose edge nodes' births loopwarden-feed lists")
          .excludes(tags)
          .excludes(opcua);
  command.setting("--feed-config", o.feed_config, "of loopwarden-feed: the broker, ask_rebirth")
      .needs(sparkplug);
  command.setting("--seconds", o.seconds, "time to wait for birth messages, s", between(1, 3600))
      .needs(sparkplug);
  command.option("--rules", o.rules,
                 "rules for the site's names, YAML: docs/reference/import-formats.md");
  command.option("--feeder", o.feeder,
                 "feeder of the values, by its name in loopwardend.yaml: opcua, or mqtt with "
                 "--sparkplug");
  command.option("--sample-time", o.sample_time_s, "of all loops, s; default 1, as a guess",
                 between(0.001, 3600.0));
  command.option(
      "--nodes", o.nodes,
      "also write the feeder's requests, `nodes` of opcua.yaml or `metrics` of feed.yaml, "
      "to this new file");
  command.required("--out", o.out,
                   "folder for TAG.yaml, and TAG.yaml.incomplete if a unit or range is not "
                   "known; existing files are not changed");
  command.flag("--json", o.json, "print JSON");
  command.footer(
      "Exit code 65: no file was written; 74: also no birth was heard; 78: also a server whose "
      "certificate is not trusted yet.\n"
      "Example: loopwarden discover --tags tags.csv --out /etc/loopwardend/loops.d");
}

}  // namespace loopwarden::workbench
