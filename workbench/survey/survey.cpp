// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/survey.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include "hal/os/parallel.hpp"
#include "workbench/command_line/progress.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/survey/join.hpp"
#include "workbench/survey/survey_page.hpp"
#include "workbench/text/import_json.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t kAtOnceBytes = 256ULL * 1024ULL * 1024ULL;  // of values in memory
constexpr std::size_t kAtOnceLoops = 256;

std::optional<json> read_json(const fs::path& path) {
  std::ifstream in(path);
  if (!in) return std::nullopt;
  json read = json::parse(in, nullptr, false);
  if (read.is_discarded() || !read.is_object()) return std::nullopt;
  return read;
}

// What the result of a loop depends on: the version, the settings, and its files as they are.
std::string key_of(const record::Importer& importer, const record::FoundLoop& loop,
                   const SurveyRun& run) {
  std::string text =
      fmt::format("{} {} {} {} {}", LOOPWARDEN_VERSION, run.settings.window_s, run.settings.kind,
                  fmt::join(run.settings.co_range, " "), record::fingerprint(run.import));
  for (const std::string& name : loop.signals.names) text += "|" + name;
  for (const std::size_t file : loop.files) {
    std::error_code problem;
    const fs::path& path = importer.files()[file];
    text += fmt::format("|{} {} {}", path.string(), fs::file_size(path, problem),
                        fs::last_write_time(path, problem).time_since_epoch().count());
  }
  return fmt::format("{:016x}", stable_hash(text));
}

fs::path file_of(const fs::path& out, const std::string& tag) {
  return out / "loops" /
         fmt::format("{}-{:08x}.json", file_name_for(tag), stable_hash(tag) & 0xFFFFFFFFU);
}

}  // namespace

SurveyCount judge_all(const SurveyRun& run) {
  record::Importer importer({run.paths.begin(), run.paths.end()}, run.import, true);
  OutputFiles folders;
  folders.make_folder(run.out);
  folders.make_folder(run.out / "loops");
  folders.commit();
  SurveyCount count;
  json failed = json::array();
  for (const record::FileProblem& problem : importer.problems()) {
    failed.push_back({{"file", problem.file}, {"why", problem.why}});
  }
  std::vector<std::size_t> open;
  std::set<fs::path> wanted;
  for (std::size_t k = 0; k < importer.loops().size(); ++k) {
    const record::FoundLoop& loop = importer.loops()[k];
    if (!run.share.has(loop.tag)) continue;
    const std::string file = importer.files()[loop.files.front()].string();
    if (!loop.signals.has(record::Role::pv) || !loop.signals.has(record::Role::co)) {
      failed.push_back(
          {{"file", file},
           {"loop", loop.tag},
           {"why", loop.signals.has(record::Role::pv) ? "no CO: nothing can be said of the valve"
                                                      : "no PV"}});
      continue;
    }
    ++count.loops;
    const fs::path path = file_of(run.out, loop.tag);
    wanted.insert(path);
    const auto before = read_json(path);
    if (before && before->value("key", "") == key_of(importer, loop, run)) {
      ++count.resumed;
    } else {
      open.push_back(k);
    }
  }
  // Results of loops that are no longer asked for would stand in the list.
  for (const auto& entry : fs::directory_iterator(run.out / "loops")) {
    if (entry.path().extension() == ".json" && wanted.count(entry.path()) == 0) {
      fs::remove(entry.path());
    }
  }
  Progress progress("survey", open.size());
  std::size_t done = 0;
  for (std::size_t from = 0; from < open.size();) {
    std::size_t to = from;
    std::uint64_t bytes = 0;
    while (to < open.size() && to - from < kAtOnceLoops && (to == from || bytes < kAtOnceBytes)) {
      bytes += importer.bytes_of(open[to++]);
    }
    std::vector<std::pair<std::size_t, record::Imported>> batch;
    importer.read(
        std::span(open).subspan(from, to - from),
        [&](std::size_t loop, record::Imported imported) {
          batch.emplace_back(loop, std::move(imported));
        },
        [&](std::size_t loop, const record::RecordError& error) {
          failed.push_back(
              {{"file", importer.files()[importer.loops()[loop].files.front()].string()},
               {"loop", importer.loops()[loop].tag},
               {"why", error.what()}});
        });
    hal::os::parallel_for(
        batch.size(), run.jobs,
        [&](std::size_t k) {
          const record::FoundLoop& loop = importer.loops()[batch[k].first];
          json result = judge_loop(std::move(batch[k].second), run.settings);
          result["key"] = key_of(importer, loop, run);
          write_output(file_of(run.out, loop.tag), result.dump() + "\n");
        },
        [&](std::size_t ready) { progress.update(done + ready); });
    done += to - from;
    count.judged += batch.size();
    from = to;
  }
  count.failed = failed.size();
  write_output(run.out / "failed.json", json{{"failed", failed}}.dump(2) + "\n");
  return count;
}

void write_survey(const std::vector<fs::path>& folders, const fs::path& out) {
  std::map<std::string, json> by_tag;
  json failed = json::array();
  for (const fs::path& folder : folders) {
    const auto problems = read_json(folder / "failed.json");
    if (!problems || !fs::is_directory(folder / "loops")) {
      throw CommandError(kExitData, fmt::format("{}: no survey was made here", folder.string()));
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
      by_tag.insert_or_assign(loop->at("tag").get<std::string>(), std::move(*loop));
    }
  }
  std::vector<json> loops;
  for (auto& [tag, loop] : by_tag) loops.push_back(std::move(loop));
  json survey = join_survey(std::move(loops), std::move(failed));
  OutputFiles files;
  files.make_folder(out);
  write_survey_pages(survey, out, files);
  for (json& loop : survey["loops"]) loop.erase("picture");
  files.add(out / "survey.json", survey.dump(1) + "\n");
  files.add(out / "survey.csv", survey_csv(survey));
  files.commit();
}

}  // namespace loopwarden::workbench
