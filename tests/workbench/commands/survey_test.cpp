// SPDX-License-Identifier: Apache-2.0
// `loopwarden import`, `survey` and `batch` as their users call them.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "record/record_csv.hpp"
#include "tests/support/archive.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/zip_file.hpp"

namespace loopwarden::tests::survey_command_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

ShellOutcome loopwarden(const std::string& arguments) {
  return run(LOOPWARDEN_CLI " " + arguments + " 2>&1");
}

// A loop at 1 s with a disturbance, whose valve sticks by `s` CO units. 0: it does not stick.
std::string model_text(double s, int seed, double period_scale = 1.0) {
  return "sample_time: 1.0\n"
         "controller: {kp: 1.0, ki: " +
         std::to_string(0.12 / period_scale) + ", output: [0, 100]}\n" +
         (s > 0.0
              ? "valve:\n  effects:\n    - {effect: stiction, s: " + std::to_string(s) + ", j: 2}\n"
              : std::string()) +
         "process: {gain: 0.36, time_constant: 4.0, dead_time: 2.0}\n"
         "transmitter: {range: [0, 40], resolution: 0.001, noise: 0.04}\n"
         "disturbances:\n  - {effect: random_load, intensity: 0.02, time_constant: 200}\n"
         "scenario: {duration: 3600, set_point: [[0, 18], [600, 20], [1300, 17], [2000, 19], "
         "[2800, 21]], seed: " +
         std::to_string(seed) + "}\n";
}

class Plant {
 public:
  record::Record simulated(double s, int seed) {
    write_file(folder_ / "m.yaml", model_text(s, seed));
    const ShellOutcome made = loopwarden("simulate " + path("m.yaml") + " --out " + path("r.csv"));
    INFO(made.text);
    REQUIRE(made.exit_code == 0);
    record::Record r = record::read_record(folder_ / "r.csv");
    fs::remove(folder_ / "r.csv");
    fs::remove(folder_ / "m.yaml");
    return r;
  }
  // One export with one column per signal.
  void write_export(const std::string& name,
                    const std::vector<std::pair<std::string, record::Record>>& loops) {
    std::string text = "Timestamp";
    for (const auto& [tag, r] : loops) text += "," + tag + ".PV," + tag + ".OP," + tag + ".SP";
    text += "\n";
    for (std::size_t k = 0; k < loops.front().second.size(); ++k) {
      char time[80];
      std::snprintf(time, sizeof time, "2026-03-01T%02zu:%02zu:%02zuZ", 10 + k / 3600, k / 60 % 60,
                    k % 60);
      text += time;
      for (const auto& [tag, r] : loops) {
        char cells[96];
        std::snprintf(cells, sizeof cells, ",%.4f,%.4f,%g", r.pv[k], r.co[k], r.sp[k]);
        text += cells;
      }
      text += "\n";
    }
    write_file(folder_ / name, text);
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  const TemporaryFolder& folder() const { return folder_; }

 private:
  TemporaryFolder folder_;
};

json read_json(const fs::path& path) { return json::parse(read_file(path)); }

TEST_CASE("import writes one record per loop in the fixed format, and a note",
          "[import][program]") {
  Plant plant;
  const record::Record a = plant.simulated(0.0, 1);
  const record::Record b = plant.simulated(5.0, 2);
  plant.write_export("e.csv", {{"FIC1", a}, {"FIC2", b}});
  const ShellOutcome listed = loopwarden("import --list " + plant.path("e.csv"));
  CHECK(listed.exit_code == 0);
  CHECK(listed.text.find("FIC2") != std::string::npos);
  const ShellOutcome made =
      loopwarden("import " + plant.path("e.csv") + " --out " + plant.path("out"));
  INFO(made.text);
  REQUIRE(made.exit_code == 0);
  const record::Record again = record::read_record(plant.folder() / "out/FIC2.csv");
  CHECK(again.size() == b.size());
  CHECK(again.period_s == 1.0);
  CHECK(again.pv[100] == Approx(b.pv[100]).margin(1e-4));
  const json note = read_json(plant.folder() / "out/import.json");
  CHECK(note["loops"].size() == 2);
  CHECK(note["loops"][0]["start"] == "2026-03-01T10:00:00Z");
  CHECK(note["loops"][0]["compression"]["kind"] == "none");
  CHECK(read_file(plant.folder() / "out/import.txt").find("period 1 s") != std::string::npos);
  const std::string one = plant.path("e.csv") + " --loop fic1 --out " + plant.path("one");
  CHECK(loopwarden("import " + one).exit_code == 0);
  CHECK(read_json(plant.folder() / "one/import.json")["loops"].size() == 1);
  CHECK_FALSE(fs::exists(plant.folder() / "one/FIC2.csv"));
  CHECK(loopwarden("import " + plant.path("e.csv") + " --check --loop FIC9").exit_code == 65);
  CHECK(loopwarden("import " + plant.path("e.csv")).exit_code == 64);
  CHECK(loopwarden("import /nonexistent.csv --list").exit_code == 74);
}

TEST_CASE("one value per row from standard input, and loops without names that show them",
          "[import][program]") {
  Plant plant;
  const record::Record r = plant.simulated(5.0, 2);
  std::string text = "Tag,Timestamp,Value\n";
  std::string nameless = "time,A,B\n";
  for (std::size_t k = 0; k < r.size(); ++k) {
    char rows[200];
    std::snprintf(rows, sizeof rows, "F1.PV,%zu,%.4f\nF1.OP,%zu,%.4f\n", 1772359200 + k, r.pv[k],
                  1772359200 + k, r.co[k]);
    text += rows;
    std::snprintf(rows, sizeof rows, "%zu,%.4f,%.4f\n", k, r.pv[k], r.co[k]);
    nameless += rows;
  }
  write_file(plant.folder() / "long.csv", text);
  const ShellOutcome listed =
      run("cat " + plant.path("long.csv") + " | " LOOPWARDEN_CLI " import - --check 2>&1");
  INFO(listed.text);
  CHECK(listed.exit_code == 0);
  CHECK(listed.text.find("standard input: F1: pv 'F1.PV' co 'F1.OP'") != std::string::npos);
  write_file(plant.folder() / "n.csv", nameless);
  const ShellOutcome asked = loopwarden("import --check " + plant.path("n.csv"));
  CHECK(asked.exit_code == 65);
  CHECK(asked.text.find("--map pv=NAME,co=NAME") != std::string::npos);
  const ShellOutcome told =
      loopwarden("survey " + plant.path("n.csv") + " --map pv=A,co=B --out " + plant.path("s"));
  INFO(told.text);
  CHECK(told.exit_code == 0);
  CHECK(read_json(plant.folder() / "s/survey.json")["loops"][0]["tag"] == "n");
}

TEST_CASE("a full disk ends import and survey with its own exit code", "[import][program]") {
  Plant plant;
  plant.write_export("e.csv", {{"FIC1", plant.simulated(0.0, 1)}});
  for (const std::string command : {"import", "survey"}) {
    // A limit of 4 kB per file simulates a full disk.
    const ShellOutcome full = run("ulimit -f 4; trap '' XFSZ; " LOOPWARDEN_CLI " " + command + " " +
                                  plant.path("e.csv") + " --out " + plant.path(command) + " 2>&1");
    INFO(full.text);
    CHECK(full.exit_code == 74);
    CHECK(full.text.find(".tmp") == std::string::npos);
  }
}

TEST_CASE("a format file gives what can't be detected, and its errors have their place",
          "[import][program]") {
  Plant plant;
  std::string text = "a;b;c\n";
  for (int k = 0; k < 300; ++k) {
    text += std::to_string(k) + "," + std::to_string(k % 10) + ";" + std::to_string(20 + k % 7) +
            ",5;" + std::to_string(50 + k % 3) + "\n";
  }
  write_file(plant.folder() / "e.txt", text);
  write_file(
      plant.folder() / "f.yaml",
      "decimal: comma\ntime: {column: a, form: seconds}\nloops:\n  - {tag: FIC9, pv: b, co: c}\n");
  const std::string read =
      "import --list --json --format " + plant.path("f.yaml") + " " + plant.path("e.txt");
  const ShellOutcome good = loopwarden(read);
  INFO(good.text);
  REQUIRE(good.exit_code == 0);
  CHECK(json::parse(good.text.substr(0, good.text.rfind("1 of 1 file read")))["loops"][0]["tag"] ==
        "FIC9");
  write_file(plant.folder() / "f.yaml", "decimals: comma\n");
  const ShellOutcome bad = loopwarden(read);
  CHECK(bad.exit_code == 78);
  CHECK(bad.text.find("f.yaml:1:1: error: unknown key 'decimals'") != std::string::npos);
  CHECK(bad.text.find("did you mean 'decimal'?") != std::string::npos);
}

TEST_CASE("the requested window changes figures, never a verdict", "[survey][program]") {
  Plant plant;
  plant.write_export("e.csv",
                     {{"FIC1", plant.simulated(0.0, 1)}, {"FIC2", plant.simulated(5.0, 2)}});
  const auto surveyed = [&](const std::string& hours) {
    const std::string out = plant.path("out" + hours);
    REQUIRE(loopwarden("survey " + plant.path("e.csv") + " --window " + hours + " --out " + out)
                .exit_code == 0);
    json loops = json::object();
    const json survey = read_json(out + "/survey.json");
    for (const json& loop : survey["loops"]) {
      loops[loop["tag"].get<std::string>()] = loop;
    }
    return loops;
  };
  const json whole = surveyed("8");
  const json parts = surveyed("0.25");
  for (const char* tag : {"FIC1", "FIC2"}) {
    CHECK(whole[tag]["windows"].size() == 1);
    CHECK(parts[tag]["windows"].size() > 2);
    for (const char* key : {"verdict", "grade", "probability", "cause", "effects", "since_s"}) {
      INFO(tag << ' ' << key);
      CHECK(whole[tag][key] == parts[tag][key]);
    }
  }
  CHECK(whole["FIC2"]["verdict"] == "valve_effect");
}

TEST_CASE(
    "verdicts are right on compressed archive records, and the output states the detection limit",
    "[import][program][gap]") {
  Plant plant;
  write_file(plant.folder() / "model.yaml",
             model_text(0.0, 1).substr(0, model_text(0.0, 1).find("disturbances")));
  for (const double s : {0.0, 5.0}) {
    record::Record r = plant.simulated(s, 5);
    for (const bool held : {false, true}) {
      record::Record kept = r;
      const auto keep = [held](const std::vector<double>& x, double deviation) {
        return with_decimals(held ? held_between(x, by_exception(x, deviation))
                                  : lines_between(x, by_swinging_door(x, deviation)),
                             4);
      };
      kept.pv = keep(r.pv, 0.2);
      kept.co = keep(r.co, 0.5);
      plant.write_export("e.csv", {{"FIC1", kept}});
      const ShellOutcome diagnosed =
          run(LOOPWARDEN_CLI " diagnose " + plant.path("e.csv") + " --json 2>/dev/null");
      INFO(diagnosed.text << s << held);
      const json d = json::parse(diagnosed.text);
      CHECK(d["import"]["compression"]["kind"] == (held ? "exception" : "swinging_door"));
      CHECK(d["import"]["sees_from_percent"].get<double>() > 0.1);
      CHECK(d["import"]["sees_from_percent"].get<double>() < 4.0);
      const std::string verdict = d["verdict"];
      if (s > 0.0) {
        CHECK(verdict == "valve_effect");
      } else {
        CHECK((verdict == "healthy" || verdict == "cant_tell"));
      }
      if (held == (s > 0.0)) continue;  // two searches are enough
      const ShellOutcome found = run(LOOPWARDEN_CLI " gap " + plant.path("e.csv") + " --model " +
                                     plant.path("model.yaml") + " --out " + plant.path("gap") +
                                     " --to 1800 --json 2>/dev/null");
      const json g = json::parse(found.text);
      INFO(found.text);
      if (s > 0.0) {
        REQUIRE(g["verdict"] == "missing_effect");
        CHECK(g["effects"][0]["name"] == "stiction");
        for (const json& e : g["effects"]) CHECK(e["confidence"].get<double>() < 0.9);
      } else {
        CHECK(g["verdict"] == "no_gap");
      }
    }
  }
}

TEST_CASE("a record of every second sample, and a record of CO before its limits",
          "[import][program][gap]") {
  Plant plant;
  std::string text = model_text(0.0, 1).substr(0, model_text(0.0, 1).find("disturbances"));
  text.replace(text.find("[0, 100]"), 8, "[0, 55]");
  write_file(plant.folder() / "model.yaml", text);
  const record::Record r = plant.simulated(0.0, 5);
  std::string half = "time,pv,sp,co\n";
  std::string wide = half;
  for (std::size_t k = 0; k < 1800; ++k) {
    char row[120];
    std::snprintf(row, sizeof row, "%zu,%.4f,%g,%.4f\n", k, r.pv[k], r.sp[k],
                  std::min(r.co[k], 55.0));
    if (k % 2 == 0) half += row;
    std::snprintf(row, sizeof row, "%zu,%.4f,%g,%.4f\n", k, r.pv[k], r.sp[k],
                  k == 900 ? 57.0 : std::min(r.co[k], 55.0));
    wide += row;
  }
  write_file(plant.folder() / "half.csv", half);
  write_file(plant.folder() / "wide.csv", wide);
  const auto gap = [&](const std::string& record) {
    return "gap " + plant.path(record) + " --model " + plant.path("model.yaml") + " --out " +
           plant.path("g");
  };
  const ShellOutcome slow = run(LOOPWARDEN_CLI " " + gap("half.csv") + " --json 2>/dev/null");
  const json found = json::parse(slow.text);
  for (const json& e : found["effects"]) CHECK(e["confidence"].get<double>() <= 0.85);
  CHECK(slow.text.find("every 2 s, the model every 1 s") != std::string::npos);
  const ShellOutcome refused = loopwarden(gap("wide.csv"));
  CHECK(refused.exit_code == 65);
  CHECK(refused.text.find("--clip-co") != std::string::npos);
  CHECK(run(LOOPWARDEN_CLI " " + gap("wide.csv") + " --clip-co --json 2>/dev/null").exit_code == 0);
}

TEST_CASE("a record in % is reported as such, before any effect is named",
          "[import][program][gap]") {
  Plant plant;
  write_file(plant.folder() / "model.yaml",
             model_text(0.0, 1).substr(0, model_text(0.0, 1).find("disturbances")));
  record::Record r = plant.simulated(0.0, 5);
  for (std::size_t k = 0; k < r.size(); ++k) {
    r.pv[k] *= 2.5;
    r.sp[k] *= 2.5;
  }
  plant.write_export("e.csv", {{"FIC1", r}});
  const std::string gap = "gap " + plant.path("e.csv") + " --model " + plant.path("model.yaml") +
                          " --to 1200 --out " + plant.path("g");
  const ShellOutcome asked = loopwarden(gap);
  CHECK(asked.exit_code == 65);
  CHECK(asked.text.find("looks like another unit (% of the PV range)") != std::string::npos);
  CHECK(asked.text.find("--pv-range") != std::string::npos);
  const ShellOutcome told = run(LOOPWARDEN_CLI " " + gap + " --pv-range 0 100 --json 2>/dev/null");
  CHECK(json::parse(told.text)["verdict"] == "no_gap");
  // CO as a share of its range. An earlier version reported controller_mismatch and output_bias.
  for (std::size_t k = 0; k < r.size(); ++k) {
    r.pv[k] /= 2.5;
    r.sp[k] /= 2.5;
    r.co[k] /= 100.0;
  }
  record::write_record(r, plant.folder() / "share.csv");
  const ShellOutcome share = loopwarden("gap " + plant.path("share.csv") + " --model " +
                                        plant.path("model.yaml") + " --out " + plant.path("g"));
  CHECK(share.exit_code == 65);
  CHECK(share.text.find("--co-range 0 1;") != std::string::npos);
  // If the user states that the units are the same, gap names the effects.
  const ShellOutcome denied = run(LOOPWARDEN_CLI " " + gap + " --pv-range 0 40 --json 2>/dev/null");
  CHECK(json::parse(denied.text)["verdict"] == "missing_effect");
}

TEST_CASE(
    "survey ranks a plant, equally with any threads and shares, and continues after an "
    "interruption",
    "[survey][program]") {
  Plant plant;
  plant.write_export("a.csv",
                     {{"FIC101", plant.simulated(0.0, 1)}, {"FIC102", plant.simulated(5.0, 2)}});
  plant.write_export("b.csv",
                     {{"FIC103", plant.simulated(6.0, 3)}, {"FIC104", plant.simulated(0.0, 4)}});
  write_file(plant.folder() / "broken.csv", "not an export\n");
  write_file(plant.folder() / "old.csv",  // an earlier day of one of the loops, cut in the middle
             "Timestamp,FIC103.PV,FIC103.OP\n2026-02-01T10:00:00Z,1,2\n2026-02-01T10:00:01Z,1,2\n"
             "2026-02-01T10:00:02Z,1,\"2\n2026-02-01T10:00:03Z,1,2\n");
  const std::string files = plant.path("a.csv") + " " + plant.path("b.csv") + " " +
                            plant.path("broken.csv") + " " + plant.path("old.csv");
  const ShellOutcome one = loopwarden("survey " + files + " --jobs 1 --out " + plant.path("one"));
  INFO(one.text);
  REQUIRE(one.exit_code == 65);  // two files could not be read
  CHECK_THAT(one.text,
             Catch::Contains("\n4 files: 2 read, 2 could not be read; 4 loops: 4 judged, 0 from an "
                             "earlier run, 0 could not be read\n"));
  const json survey = read_json(plant.folder() / "one/survey.json");
  REQUIRE(survey["loops"].size() == 4);
  REQUIRE(survey["failed"].size() == 2);
  CHECK(survey["failed"][0]["why"].get<std::string>().find("broken.csv") != std::string::npos);
  for (int rank = 0; rank < 2; ++rank) {
    const json& sick = survey["loops"][static_cast<std::size_t>(rank)];
    CHECK(sick["rank"] == rank + 1);
    CHECK((sick["tag"] == "FIC102" || sick["tag"] == "FIC103"));
    CHECK(sick["verdict"] == "valve_effect");
    CHECK(sick["next"]["what"] == (sick["grade"] == "seen" ? "repair" : "test the valve"));
    CHECK(sick["windows"].size() == 1);
  }
  // The terminal has the orders of worklist.csv in the same sequence.
  REQUIRE(survey["worklist"].size() >= 2);
  std::size_t at = one.text.find("\norder ");
  for (const json& order : survey["worklist"]) {
    at = one.text.find("\n    " + std::to_string(order["order"].get<int>()) + "  " +
                           order["tag"].get<std::string>(),
                       at);
    CHECK(at != std::string::npos);
  }
  CHECK(one.text.find("\n    -  ", at) != std::string::npos);
  CHECK(survey["loops"][3]["verdict"] == "healthy");
  CHECK(survey["loops"][3]["travel_per_hour"].get<double>() > 0.0);
  CHECK(fs::exists(plant.folder() / "one/assets/uPlot.iife.min.js"));
  const std::string page = read_file(plant.folder() / "one/survey.html");
  CHECK(page.find("FIC102") != std::string::npos);
  CHECK(page.find("http") == std::string::npos);
  // A loop's page has the export's clock, sizes, and the result of each window.
  const std::string own =
      read_file(plant.folder() / "one/pages" /
                ("0001-" + survey["loops"][0]["tag"].get<std::string>() + ".html"));
  for (const char* part : {"2026-03-01 10:00", "90 % interval", "SP crossings /h",
                           "<dt>Clock</dt><dd>UTC</dd>", "\"start_s\":1772359200.0"}) {
    INFO(part);
    CHECK(own.find(part) != std::string::npos);
  }
  CHECK(read_file(plant.folder() / "one/survey.csv").find("\n1,FIC10") != std::string::npos);

  CHECK(loopwarden("survey " + files + " --jobs 3 --out " + plant.path("three")).exit_code == 65);
  CHECK(read_file(plant.folder() / "three/survey.json") ==
        read_file(plant.folder() / "one/survey.json"));
  std::string shares;
  for (int k = 1; k <= 3; ++k) {
    const std::string out = plant.path("share" + std::to_string(k));
    CHECK(loopwarden("survey " + files + " --shard " + std::to_string(k) + "/3 --out " + out)
              .exit_code == 65);
    shares += " " + out;
  }
  CHECK(loopwarden("survey --merge" + shares + " --out " + plant.path("merged")).exit_code == 65);
  for (const char* file : {"survey.json", "survey.csv", "survey.html"}) {
    CHECK(read_file(plant.folder() / "merged" / file) == read_file(plant.folder() / "one" / file));
  }
  // The state after a kill: one result is missing, and one is half written.
  std::size_t spoiled = 0;
  for (const auto& entry : fs::directory_iterator(plant.folder() / "one/loops")) {
    if (spoiled == 0) {
      fs::remove(entry.path());
    } else if (spoiled == 1) {
      write_file(entry.path(), read_file(entry.path()).substr(0, 100));
    }
    ++spoiled;
  }
  const ShellOutcome again = loopwarden("survey " + files + " --out " + plant.path("one"));
  CHECK(again.text.find("2 judged, 2 from an earlier run") != std::string::npos);
  CHECK(read_file(plant.folder() / "one/survey.json") ==
        read_file(plant.folder() / "merged/survey.json"));
  // Another window gives another result.
  CHECK(loopwarden("survey " + files + " --window 0.5 --out " + plant.path("one"))
            .text.find("4 judged") != std::string::npos);
  CHECK(read_json(plant.folder() / "one/survey.json")["loops"][0]["windows"].size() == 2);
  CHECK(loopwarden("survey " + files + " --shard 4/3 --out " + plant.path("x")).exit_code == 64);
  CHECK(loopwarden("survey --merge " + plant.path("nothing") + " --out " + plant.path("x"))
            .exit_code == 65);
}

TEST_CASE("import and survey end with 65 for unreadable files, and the counts add up",
          "[import][survey][program]") {
  Plant plant;
  fs::create_directory(plant.folder() / "e");
  plant.write_export("e/a.csv",
                     {{"FIC101", plant.simulated(0.0, 1)}, {"FIC102", plant.simulated(5.0, 2)}});
  const std::string folder = plant.path("e");
  const auto all = [&](int list_code, int import_code, int survey_code) {
    const ShellOutcome listed = loopwarden("import --list " + folder);
    const ShellOutcome imported = loopwarden("import " + folder + " --out " + plant.path("out"));
    const ShellOutcome surveyed = loopwarden("survey " + folder + " --out " + plant.path("s"));
    INFO(listed.text << imported.text << surveyed.text);
    CHECK(listed.exit_code == list_code);
    CHECK(imported.exit_code == import_code);
    CHECK(surveyed.exit_code == survey_code);
    return std::array{listed.text, imported.text, surveyed.text};
  };
  all(0, 0, 0);
  // A loop with only a PV can't be judged, which is no failure. A file that is no export is no
  // failure either.
  write_file(plant.folder() / "e/t.csv",
             "Timestamp,TI205.PV\n2026-03-01T10:00:00Z,1\n"
             "2026-03-01T10:00:01Z,2\n2026-03-01T10:00:02Z,3\n");
  write_file(plant.folder() / "e/values.json", "{}");
  const auto alone = all(0, 0, 0);
  for (const std::string& text : alone)
    CHECK(text.find("values.json: JSON is not read") != std::string::npos);
  for (const std::size_t k : {0UL, 1UL})
    CHECK(alone[k].ends_with("\n2 of 2 files read, 3 of 3 loops; 1 file skipped\n"));
  const std::size_t skipped = alone[2].find("\nskipped: ");
  const std::size_t counts = alone[2].find(
      "\n2 files: 2 read, 0 could not be read; 2 loops: 0 judged, 2 from an earlier run, 0 could "
      "not be read; 1 loop without PV or CO; 1 file skipped\n");
  CHECK(skipped < counts);
  CHECK(counts < alone[2].find("\norder "));
  // An earlier day of a loop, with a broken row.
  std::string day = "Timestamp,FIC101.PV,FIC101.OP\n";
  for (int k = 0; k < 500; ++k) {
    char row[64];
    std::snprintf(row, sizeof row, "2026-02-01T10:%02d:%02dZ,%d,50%s\n", k / 60, k % 60, k % 9,
                  k == 450 ? ",1" : "");
    day += row;
  }
  write_file(plant.folder() / "e/day.csv", day);
  const auto in_part = all(0, 65, 65);
  CHECK(in_part[1].ends_with(
      "\n2 of 3 files read, 3 of 3 loops; 1 file could not be read: see above; "
      "1 loop read without some of the files; 1 file skipped\n"));
  for (int again = 0; again < 2; ++again) {
    const ShellOutcome more = loopwarden("survey " + folder + " --out " + plant.path("s"));
    CHECK(more.exit_code == 65);
    CHECK_THAT(
        more.text,
        Catch::Contains("\n3 files: 2 read, 1 could not be read; 2 loops: 0 judged, 2 from an "
                        "earlier run, 0 could not be read; 1 loop judged without some of the "
                        "files; 1 loop without PV or CO; 1 file skipped\n"));
  }
  fs::remove(plant.folder() / "e/day.csv");
  // A file that is no export, and a loop with a cell that is no number.
  write_file(plant.folder() / "e/b.csv", "not an export\n");
  CHECK(
      all(65, 65, 65)[1].ends_with("\n2 of 3 files read, 3 of 3 loops; 1 file could not be read: "
                                   "see above; 1 file skipped\n"));
  // The same if the file is named on the command line.
  const ShellOutcome named =
      loopwarden("import " + plant.path("e/b.csv") + " " + plant.path("e/a.csv") + " --check");
  CHECK(named.exit_code == 65);
  CHECK(named.text.ends_with(
      "\n1 of 2 files read, 2 of 2 loops; 1 file could not be read: see above\n"));
  fs::remove(plant.folder() / "e/b.csv");
  std::string spoiled = read_file(plant.folder() / "e/a.csv");
  const std::size_t place = spoiled.find(',', spoiled.size() / 2);
  spoiled.insert(place, ".1.");
  write_file(plant.folder() / "e/a.csv", spoiled);
  const ShellOutcome imported = loopwarden("import " + folder + " --out " + plant.path("out2"));
  INFO(imported.text);
  CHECK(imported.exit_code == 65);
  CHECK(
      imported.text.ends_with("\n2 of 2 files read, 2 of 3 loops; 1 loop could not be read: see "
                              "above; 1 file skipped\n"));
  const ShellOutcome surveyed = loopwarden("survey " + folder + " --out " + plant.path("s2"));
  INFO(surveyed.text);
  CHECK(surveyed.exit_code == 65);
  CHECK(
      surveyed.text.find(
          "2 files: 2 read, 0 could not be read; 2 loops: 1 judged, 0 from an earlier run, 1 could "
          "not be read; ") != std::string::npos);
}

TEST_CASE("the members of an archive are surveyed, and judged again if the archive changed",
          "[survey][program]") {
  Plant plant;
  plant.write_export("a.csv", {{"FIC1", plant.simulated(5.0, 2)}});
  plant.write_export("b.csv", {{"FIC1", plant.simulated(0.0, 1)}});
  const std::string command = "survey " + plant.path("week.zip") + " --out " + plant.path("s");
  write_zip(plant.folder() / "week.zip", {{"day/a.csv", read_file(plant.folder() / "a.csv")}});
  const ShellOutcome first = loopwarden(command);
  INFO(first.text);
  REQUIRE(first.exit_code == 0);
  CHECK_THAT(first.text,
             Catch::Contains("1 file: 1 read, 0 could not be read; 1 loop: 1 judged, 0 from an "
                             "earlier run, 0 could not be read\n"));
  CHECK(loopwarden(command).text.find("0 judged, 1 from an earlier run") != std::string::npos);
  write_zip(plant.folder() / "week.zip", {{"day/a.csv", read_file(plant.folder() / "b.csv")}});
  CHECK(loopwarden(command).text.find("1 judged, 0 from an earlier run") != std::string::npos);
  const ShellOutcome one = loopwarden("diagnose " + plant.path("week.zip/day/a.csv"));
  CHECK(one.exit_code == 0);
  CHECK(one.text.find("week.zip/day/a.csv: zip, comma") != std::string::npos);
  CHECK(loopwarden("survey " + plant.path("none.zip") + " --out " + plant.path("x")).exit_code ==
        74);
}

TEST_CASE("batch runs each command once, keeps its exit code, and divides the work into shares",
          "[batch][program]") {
  Plant plant;
  plant.write_export("a.csv", {{"FIC101", plant.simulated(5.0, 2)}});
  write_file(plant.folder() / "jobs.txt",
             "# two that work, one that doesn't\nloopwarden diagnose \"" + plant.path("a.csv") +
                 "\" --json\nversion\n\ndiagnose " + plant.path("none.csv") + "\n");
  const std::string batch = "batch " + plant.path("jobs.txt");
  const ShellOutcome first = loopwarden(batch);
  INFO(first.text);
  CHECK(first.exit_code == 65);
  CHECK(first.text.find("jobs.txt:5: exit code 74") != std::string::npos);
  CHECK(first.text.find("3 commands, 1 of them failed") != std::string::npos);
  std::string logs;
  for (const auto& entry : fs::directory_iterator(plant.folder() / "jobs.txt.results")) {
    if (entry.path().extension() == ".log") logs += read_file(entry.path());
  }
  CHECK(logs.find("valve_effect") != std::string::npos);
  CHECK(logs.find("none.csv") != std::string::npos);
  CHECK(loopwarden(batch).text.find("3 of 3 ended before") != std::string::npos);
  CHECK(loopwarden(batch + " --retry").text.find("2 of 3 ended before") != std::string::npos);
  std::size_t shared = 0;
  for (const char* share : {"1/3", "2/3", "3/3"}) {
    const ShellOutcome part = run(LOOPWARDEN_CLI " " + batch + " --json --out " +
                                  plant.path("parts") + " --shard " + share + " 2>/dev/null");
    shared += json::parse(part.text).size();
  }
  CHECK(shared == 3);
  write_file(plant.folder() / "jobs.txt", "diagnose \"a b\n");
  CHECK(loopwarden(batch).text.find("jobs.txt:1: no closing quote") != std::string::npos);
}

}  // namespace
}  // namespace loopwarden::tests::survey_command_test
