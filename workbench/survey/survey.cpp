// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/survey.hpp"

#include <fmt/format.h>

#include <fstream>
#include <map>
#include <set>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/parallel.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/records/record_input.hpp"
#include "workbench/survey/join.hpp"
#include "workbench/survey/survey_page.hpp"
#include "workbench/survey/test_log.hpp"
#include "workbench/text/import_json.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t kAtOnceBytes = 256ULL * 1024ULL * 1024ULL;  // of values in memory
constexpr std::size_t kAtOnceLoops = 256;
constexpr int kResultForm = 6;  // format of a loop's file; a file of another format is replaced

std::optional<json> read_json(const fs::path& path) {
  std::ifstream in(path);
  if (!in) return std::nullopt;
  json read = json::parse(in, nullptr, false);
  if (read.is_discarded() || !read.is_object()) return std::nullopt;
  return read;
}

// Returns a key of all inputs of a loop's result: the version, the settings, and the present files.
std::string key_of(const record::Importer& importer, const record::FoundLoop& loop,
                   const SurveyRun& run) {
  std::string text = fmt::format(
      "{} {} {} {} {} {}", LOOPWARDEN_VERSION, kResultForm, run.settings.window_s,
      run.settings.kind, fmt::join(run.settings.co_range, " "), record::fingerprint(run.import));
  text += "|" + record::fingerprint(loop.signals);
  for (const std::size_t file : loop.files) {
    std::error_code problem;
    const fs::path& path = importer.on_disk(file);
    text += fmt::format("|{} {} {}", importer.file(file).string(), fs::file_size(path, problem),
                        fs::last_write_time(path, problem).time_since_epoch().count());
  }
  return fmt::format("{:016x}", stable_hash(text));
}

fs::path file_of(const fs::path& out, const std::string& tag) {
  return out / "loops" /
         fmt::format("{}-{:08x}.json", file_name_for(tag), stable_hash(tag) & 0xFFFFFFFFU);
}

}  // namespace

namespace {

// Parts of a loop's work that are reading.
constexpr std::uint64_t kReadingParts = 1;
constexpr std::uint64_t kJudgingParts = 9;

struct OpenLoops {
  std::vector<std::size_t> open;  // of Importer::loops()
  std::set<fs::path> wanted;      // results of this share
};

// Returns the loops to judge, and counts those that an earlier run has judged.
OpenLoops open_loops(const record::Importer& importer, const SurveyRun& run, SurveyCount& count,
                     FilesRead& files) {
  OpenLoops out;
  for (std::size_t k = 0; k < importer.loops().size(); ++k) {
    const record::FoundLoop& loop = importer.loops()[k];
    if (!run.share.has(loop.tag)) continue;
    const bool has_pv = loop.signals.has(record::Role::pv);
    if (!has_pv || !loop.signals.has(record::Role::co)) {
      count.failed.push_back({{"file", importer.file(loop.files.front()).string()},
                              {"loop", loop.tag},
                              {"lost", "signals"},
                              {"why", has_pv ? "no CO: the valve can't be judged" : "no PV"}});
      continue;
    }
    ++count.loops;
    const fs::path path = file_of(run.out, loop.tag);
    out.wanted.insert(path);
    const auto before = read_json(path);
    if (before && before->value("key", "") == key_of(importer, loop, run)) {
      ++count.resumed;
      std::set<std::string> without;
      for (const json& problem : before->value("without", json::array()))
        without.insert(problem.at("file").get<std::string>());
      for (const std::size_t file : loop.files)
        (without.count(importer.file(file).string()) > 0 ? files.bad : files.good).insert(file);
    } else {
      out.open.push_back(k);
    }
  }
  return out;
}

struct ReadLoop {
  std::size_t loop;
  record::Imported imported;
  json without = json::array();  // files of the loop that can't be read
};

std::vector<ReadLoop> read_loops(record::Importer& importer, std::span<const std::size_t> which,
                                 json& failed, FilesRead& files,
                                 const record::ImportProgress& progress) {
  std::vector<ReadLoop> loops;
  std::set<std::pair<std::size_t, std::size_t>> broken_files;  // loop, file
  std::map<std::size_t, json> broken;
  importer.read(
      which,
      [&](std::size_t loop, record::Imported imported) {
        loops.push_back({loop, std::move(imported)});
        for (const std::size_t file : importer.loops()[loop].files) {
          if (broken_files.count({loop, file}) == 0) files.good.insert(file);
        }
        const auto at = broken.find(loop);
        if (at == broken.end()) return;
        loops.back().without = std::move(at->second);
        for (json& problem : loops.back().without) problem["lost"] = "part";
        broken.erase(at);
      },
      [&](std::size_t loop, std::size_t file, const record::RecordError& error) {
        broken_files.emplace(loop, file);
        files.bad.insert(file);
        broken[loop].push_back({{"file", importer.file(file).string()},
                                {"loop", importer.loops()[loop].tag},
                                {"lost", "loop"},
                                {"why", error.what()}});
      },
      progress);
  for (const auto& [loop, why] : broken) failed.insert(failed.end(), why.begin(), why.end());
  return loops;
}

// Deletes results of loops that are no longer requested, because they would appear in the list.
void forget_others(const fs::path& folder, const std::set<fs::path>& wanted) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".json" && wanted.count(entry.path()) == 0) {
      fs::remove(entry.path());
    }
  }
}

}  // namespace

SurveyCount judge_all(const SurveyRun& run) {
  std::optional<Progress> looking(std::in_place, "survey: looking at files", 1000);
  record::ImportOptions import = run.import;
  import.assume_order = true;  // verdicts do not depend on it
  record::Importer importer({run.paths.begin(), run.paths.end()}, import, true,
                            [&looking](double share) { looking->update_share(share); });
  looking.reset();
  OutputFiles folders;
  folders.make_folder(run.out);
  folders.make_folder(run.out / "loops");
  folders.commit();
  SurveyCount count;
  for (const record::FileProblem& problem : importer.problems()) {
    count.failed.push_back({{"file", problem.file}, {"lost", "file"}, {"why", problem.why}});
  }
  count.files = importer.files() + importer.problems().size();
  count.passed_over = importer.passed_over().size();
  count.said = importer.passed_over_text() + (count.passed_over > 0 ? "\n" : "");
  for (const std::string& assumed : importer.assumed()) count.said += assumed + "\n";
  if (const std::string hint = importer.pairs_hint(); !hint.empty()) count.said += hint + "\n";
  count.rules = rules_text(importer, !run.import.rules.empty());
  count.exit_code = reading_exit_code(true, true, importer);
  std::vector<record::BadWord> words;
  FilesRead files;
  const auto [open, wanted] = open_loops(importer, run, count, files);
  forget_others(run.out / "loops", wanted);
  constexpr std::uint64_t kOne = kReadingParts + kJudgingParts;
  Progress progress("survey", kOne * open.size());
  for (std::size_t from = 0; from < open.size();) {
    std::size_t to = from;
    std::uint64_t bytes = 0;
    while (to < open.size() && to - from < kAtOnceLoops && (to == from || bytes < kAtOnceBytes)) {
      bytes += importer.bytes_of(open[to++]);
    }
    const std::uint64_t reading = kReadingParts * (to - from);
    std::vector<ReadLoop> batch = read_loops(
        importer, std::span(open).subspan(from, to - from), count.failed, files, [&](double share) {
          progress.update(kOne * from +
                          static_cast<std::uint64_t>(share * static_cast<double>(reading)));
        });
    for (const ReadLoop& one : batch) {
      const auto& found = one.imported.notes.words;
      words.insert(words.end(), found.begin(), found.end());
    }
    base::parallel_for(
        batch.size(), run.jobs,
        [&](std::size_t k) {
          const record::FoundLoop& loop = importer.loops()[batch[k].loop];
          json result = judge_loop(std::move(batch[k].imported), run.settings);
          result["key"] = key_of(importer, loop, run);
          result["without"] = std::move(batch[k].without);
          write_output(file_of(run.out, loop.tag), result.dump() + "\n");
        },
        [&](std::size_t ready) { progress.update(kOne * from + reading + kJudgingParts * ready); });
    count.judged += batch.size();
    from = to;
  }
  count.said += record::bad_words_text(words);
  count.files_lost = importer.problems().size() + files.lost();
  write_output(run.out / "failed.json", json{{"failed", count.failed}}.dump(2) + "\n");
  return count;
}

json write_survey(const std::vector<fs::path>& folders, const fs::path& out,
                  const SurveyReport& how) {
  const fs::path& outcomes = how.outcomes;
  if (!outcomes.empty() && !fs::exists(outcomes))
    throw CommandError(kExitIo, fmt::format("{}: no such file", outcomes.string()));
  std::map<std::string, json> by_tag;
  json failed = json::array();
  for (const fs::path& folder : folders) {
    const auto problems = read_json(folder / "failed.json");
    if (!problems || !fs::is_directory(folder / "loops")) {
      throw CommandError(kExitData, fmt::format("{}: contains no survey", folder.string()));
    }
    for (const json& problem : problems->at("failed")) failed.push_back(problem);
    for (const auto& entry : fs::directory_iterator(folder / "loops")) {
      if (entry.path().extension() != ".json") continue;
      auto loop = read_json(entry.path());
      if (!loop) {
        throw CommandError(kExitData, fmt::format("{}: is damaged; remove it and run again",
                                                  entry.path().string()));
      }
      loop->erase("key");
      for (const json& problem : loop->value("without", json::array())) failed.push_back(problem);
      loop->erase("without");
      by_tag.insert_or_assign(loop->at("tag").get<std::string>(), std::move(*loop));
    }
  }
  std::vector<json> loops;
  for (auto& [tag, loop] : by_tag) loops.push_back(std::move(loop));
  json survey =
      join_survey(std::move(loops), std::move(failed),
                  read_outcomes(outcomes.empty() ? out / kOutcomesFile : outcomes), how.site);
  survey["worklist"] = worklist(survey, how.costs, how.weights);
  survey["costs"] = costs_json(how.costs);
  tell_tests(survey, read_tests(out / kTestsFile));
  OutputFiles files;
  files.make_folder(out);
  write_survey_pages(survey, out, files);
  for (json& loop : survey["loops"]) loop.erase("picture");
  files.add(out / "worklist.csv", worklist_csv(survey.at("worklist")));
  files.add(out / "survey.csv", survey_csv(survey));
  files.add(out / "survey.json", survey.dump(1) + "\n");
  files.commit();
  return survey;
}

}  // namespace loopwarden::workbench
