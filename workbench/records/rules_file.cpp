// SPDX-License-Identifier: Apache-2.0
#include "workbench/records/rules_file.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "base/text.hpp"
#include "config/document.hpp"
#include "config/map_reader.hpp"

namespace loopwarden::workbench {
namespace {

using config::MapReader;
using record::Role;
using record::TagRule;

std::shared_ptr<const record::ModeWords> mode_words(MapReader& in, const std::string& signal) {
  record::ModeWords words;
  bool given = false;
  const auto read = [&](const char* key, const char* meaning, std::vector<std::string>& list) {
    const auto texts = in.maybe_texts(key, meaning);
    for (const std::string& text : texts.value) list.push_back(base::lower_case(text));
    if (texts.given && signal != "mode" && signal != "as named")
      in.error(key, fmt::format("is only valid with signal: mode (here it is {})", signal));
    given = given || texts.given;
  };
  read("automatic", "of a mode: words for automatic, besides the known ones", words.automatic);
  read("manual", "of a mode: words for manual", words.manual);
  read("cascade", "of a mode: words for cascade, which counts as automatic", words.cascade);
  return given ? std::make_shared<const record::ModeWords>(std::move(words)) : nullptr;
}

constexpr const char* kMatch =
    "name of a column or tag: * any characters, ? one, [A-C7] one of these";

void read_pattern(MapReader& in, const char* meaning, record::TagPattern& pattern) {
  const auto text = in.need_text("match", meaning);
  if (!text.valid || in.describing()) return;
  try {
    pattern = record::TagPattern(text.value);
  } catch (const std::invalid_argument& e) {
    in.error("match", fmt::format("must be a pattern: {} (got '{}')", e.what(),
                                  config::quotable(text.value)));
  }
}

// Reports a text whose $1 to $9 have no wildcard.
void check_filled(MapReader& in, const char* key, const std::string& text,
                  const record::TagPattern& pattern) {
  if (pattern.text().empty() ||
      record::filled_in(text, std::vector<std::string>(pattern.wildcards(), "x")))
    return;
  in.error(key, fmt::format("must be text with $1 to $9 for one of the {} of *, ? and [...] in "
                            "'{}', and $$ for a dollar sign (got '{}')",
                            pattern.wildcards(), config::quotable(pattern.text()),
                            config::quotable(text)));
}

void read_loop(MapReader& in, const std::string& signal, TagRule& rule) {
  const auto loop = in.text(
      "loop", "tag of the loop: text, with $1 for the text at the first of *, ?, [...]", "");
  rule.loop = loop.value;
  if (in.describing()) return;
  if (rule.role && !loop.given) {
    in.error("is missing the key 'loop', the tag of the loop whose " + signal + " it is");
  } else if (!rule.role && loop.given) {
    in.error("loop", "needs signal: pv, sp, co, stem or mode in the same rule");
  }
  if (!rule.role || !loop.valid) return;
  check_filled(in, "loop", rule.loop, rule.pattern);
  if (rule.loop.empty()) in.error("loop", "must not be empty");
}

TagRule read_rule(MapReader& in, const std::string& file) {
  TagRule rule;
  rule.place = fmt::format("{}:{}", file, in.place().line);
  read_pattern(in, kMatch, rule.pattern);
  const std::string signal =
      in.word_of("signal", {"as named", "pv", "sp", "co", "stem", "mode", "none"},
                 "which signal of its loop; none: the name belongs to no loop");
  rule.role = record::role_from_text(signal);
  rule.unused = signal == "none";
  read_loop(in, signal, rule);
  rule.unit = in.text("unit", "of its values", "").value;
  const auto range = in.maybe_range(
      "range", {.meaning = "lower and upper end, in its unit; of co for survey's span"});
  if (range.given && range.valid) rule.range = range.value;
  const std::string kind =
      in.word_of("kind", {"from the tag", "flow", "pressure", "level", "temperature", "unknown"},
                 "what the loop controls; only in the rule of its pv");
  if (kind != "from the tag") rule.kind = kind;
  if (!rule.kind.empty() && rule.role && *rule.role != Role::pv)
    in.error("kind", fmt::format("is only valid with signal: pv (here it is {})", signal));
  rule.mode_words = mode_words(in, signal);
  return rule;
}

record::TagText read_tag_text(MapReader& in, const std::string& file) {
  record::TagText tag;
  tag.place = fmt::format("{}:{}", file, in.place().line);
  read_pattern(in, "tag of a loop, with the same wildcards", tag.pattern);
  const auto read = [&](const char* key, const char* meaning, std::string& to) {
    to = in.text(key, meaning, "").value;
    if (!in.describing()) check_filled(in, key, to, tag.pattern);
  };
  read("show", "tag as lists and reports show it, with $1; default: without server and folders",
       tag.show);
  read("area",
       "area as a path, such as Unit 2/Reactor, with $1; default: the tag's folders, or "
       "its number",
       tag.area);
  read("master", "of a slave in a cascade: tag of the loop that writes its set point, with $1",
       tag.master);
  if (!in.describing() && tag.show.empty() && tag.area.empty() && tag.master.empty())
    in.error("needs one of the keys show, area and master");
  return tag;
}

SiteRules read_rules(MapReader& in, const std::string& file) {
  SiteRules site;
  for (MapReader& rule : in.maybe_list("rules", "the first that matches a name decides"))
    site.rules.push_back(read_rule(rule, file));
  for (MapReader& tag : in.maybe_list("tags", "the first that matches a loop's tag decides"))
    site.tags.push_back(read_tag_text(tag, file));
  if (site.rules.empty() && site.tags.empty() && !in.describing())
    in.error("rules", "must be a list of at least one rule, or add the list tags");
  return site;
}

}  // namespace

config::Loaded<SiteRules> read_rules_text(const std::string& file, std::string_view text) {
  return config::load_text<SiteRules>(file, text,
                                      [&](MapReader& in) { return read_rules(in, file); });
}

config::Loaded<SiteRules> read_rules_file(const std::filesystem::path& path) {
  return config::load_file(path, read_rules_text);
}

config::KeyReference describe_rules() {
  return config::keys_of([](MapReader& in) { read_rules(in, ""); });
}

}  // namespace loopwarden::workbench
