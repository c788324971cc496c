// SPDX-License-Identifier: Apache-2.0
// `loopwarden discover` as its users call it.
#include <sys/stat.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::discover_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kExample = LOOPWARDEN_SOURCE_DIR "/examples/watch/tags.csv";

// The folder of a daemon's configuration.
struct Site {
  Site() {
    fs::create_directory(folder / "loops.d");
    write_file(folder / "loopwardend.yaml", "feeders:\n  opcua: {user: root}\n");
  }
  std::string path(const std::string& name) const { return (folder / name).string(); }
  std::string text(const std::string& name) const { return read_file(folder / "loops.d" / name); }
  ShellOutcome loopwarden(const std::string& arguments) const {
    return run(LOOPWARDEN_CLI " " + arguments + " 2>&1");
  }
  ShellOutcome discover(const std::string& arguments) const {
    return loopwarden("discover --out " + path("loops.d") + " " + arguments);
  }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder / "loops.d"), fs::directory_iterator{}));
  }
  // Writes a program called loopwarden-opcua, and runs discover with it in the path.
  std::string with_browser(const std::string& script) const {
    write_file(folder / "loopwarden-opcua", "#!/bin/sh\n" + script);
    ::chmod(path("loopwarden-opcua").c_str(), 0755);
    return "PATH=" + folder.path().string() + ":$PATH ";
  }
  ShellOutcome discover_by(const std::string& script) const {
    return run(with_browser(script) + "TMPDIR=" + folder.path().string() +
               " " LOOPWARDEN_CLI " discover --opcua opc.tcp://h:4840 --out " + path("loops.d") +
               " 2>&1");
  }
  TemporaryFolder folder;
};

bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("the example's tags become files that check accepts", "[discover][program]") {
  const Site site;
  const ShellOutcome made = site.discover("--tags " + std::string(kExample));
  INFO(made.text);
  REQUIRE(made.exit_code == 0);
  CHECK(site.files() == 4);
  CHECK(holds(made.text, "loops.d/FIC205.yaml: sure: loop, process_variable.unit"));
  CHECK(holds(made.text, "FIC206.yaml: sure: "));
  CHECK(holds(made.text,
              "TIC410.yaml.incomplete: sure: loop, process_variable.unit, output.unit, "
              "output.range, pv, co, sp; guessed: sample_time; missing: "
              "process_variable.range: [lower, upper end] of PV"));
  CHECK(holds(made.text, "1 tag belongs to no loop: 'TI411'"));
  CHECK(holds(made.text,
              "4 of 4 loops written. Check the guessed keys, add the missing keys to "
              "each file .incomplete and remove this ending, then run `loopwarden check " +
                  site.folder.path().string()));
  CHECK_FALSE(holds(made.text, "feeders:"));
  const ShellOutcome checked = site.loopwarden("check " + site.folder.path().string());
  INFO(checked.text);
  CHECK(checked.exit_code == 0);
  CHECK(holds(checked.text, "3 loops"));
  CHECK(holds(site.text("FIC205.yaml"), "pv: {feed: \"opcua:FIC205.PV\"}\n"));
  CHECK(holds(site.text("FIC206.yaml"), "# guessed: the same letter and number"));
  CHECK(holds(site.text("LIC301.yaml"), "range: [0, 100]  # guessed: CO is in %"));
  CHECK(site.text("TIC410.yaml.incomplete").find("# Missing, before this can be TIC410.yaml:") !=
        std::string::npos);
}

TEST_CASE("files that exist stay as they are", "[discover][program]") {
  const Site site;
  const std::string tags = "--tags " + std::string(kExample);
  write_file(site.folder / "loops.d/FIC205.yaml", "mine");
  fs::create_symlink("nowhere", site.folder / "loops.d/FIC206.yaml");
  write_file(site.folder / "loops.d/TIC410.yaml", "mine, too");
  const ShellOutcome made = site.discover(tags);
  INFO(made.text);
  CHECK(made.exit_code == 0);
  CHECK(site.text("FIC205.yaml") == "mine");
  CHECK(fs::is_symlink(site.folder / "loops.d/FIC206.yaml"));
  CHECK_FALSE(fs::exists(site.folder / "nowhere"));
  CHECK_FALSE(fs::exists(site.folder / "loops.d/TIC410.yaml.incomplete"));
  CHECK(holds(made.text, "loops.d/FIC205.yaml: exists; not changed. Remove it to write it again"));
  CHECK(holds(made.text, "1 of 4 loops written"));
  const std::string before = site.text("LIC301.yaml");
  const ShellOutcome again = site.discover(tags);
  INFO(again.text);
  CHECK(again.exit_code == 65);
  CHECK(holds(again.text, "0 of 4 loops written"));
  CHECK(site.text("LIC301.yaml") == before);
}

TEST_CASE("node ids go to a file for loopwarden-opcua", "[discover][program]") {
  const Site site;
  const std::string example = "--tags " + std::string(kExample);
  const std::string nodes = " --nodes " + site.path("nodes.yaml");
  REQUIRE(site.discover(example + nodes).exit_code == 0);
  const std::string text = read_file(site.folder / "nodes.yaml");
  CHECK(text.find("nodes:\n  \"FIC205.PV\": \"nsu=urn:plant:dcs;s=Area2.FIC205.PV\"\n") == 0);
  CHECK(std::count(text.begin(), text.end(), '\n') == 1 + 4 + 3 + 3 + 2);
  const ShellOutcome again = site.discover(example + nodes);
  CHECK(again.exit_code == 65);
  CHECK(holds(again.text, "nodes.yaml: exists; not changed"));
  // Loops with existing files have nodes as well.
  CHECK(site.discover(example + " --nodes " + site.path("again.yaml")).exit_code == 65);
  CHECK(read_file(site.folder / "again.yaml") == text);
  write_file(site.folder / "tags.csv", "tag\nF1.PV\nF1.OP\n");
  const ShellOutcome none =
      site.discover("--tags " + site.path("tags.csv") + " --nodes " + site.path("none.yaml"));
  CHECK(none.exit_code == 65);
  CHECK(holds(none.text, "no loop's tag has a node"));
  CHECK_FALSE(fs::exists(site.folder / "none.yaml"));
}

TEST_CASE("500 loops are found in one run", "[discover][program]") {
  const Site site;
  std::string text = "tag;unit;low;high\n";
  for (int k = 1; k <= 500; ++k) {
    const std::string tag = "U" + std::to_string(k % 7) + "/FIC" + std::to_string(1000 + k);
    text += tag + ".PV;m3/h;0;40,5\n" + tag + ".SP;m3/h;0;40,5\n" + tag + ".OP;%;0;100\n" + tag +
            ".MODE;;;\n";
  }
  write_file(site.folder / "tags.csv", text);
  const ShellOutcome made =
      run(LOOPWARDEN_CLI " discover --sample-time 0.5 --feeder historian --json --tags " +
          site.path("tags.csv") + " --out " + site.path("loops.d") + " 2>/dev/null");
  REQUIRE(made.exit_code == 0);
  CHECK(site.files() == 500);
  const json answer = json::parse(made.text);
  REQUIRE(answer.at("loops").size() == 500);
  const json& first = answer.at("loops")[0];
  CHECK(first.at("tag") == "FIC1001");
  CHECK(first.at("file") == site.path("loops.d/FIC1001.yaml"));
  CHECK(first.at("missing").empty());
  CHECK(first.at("guessed").size() == 2);
  CHECK(first.at("guessed").contains("mode.automatic"));
  write_file(site.folder / "loopwardend.yaml", "feeders:\n  historian: {user: root}\n");
  const ShellOutcome checked = site.loopwarden("check --json " + site.folder.path().string());
  CHECK(checked.exit_code == 0);
  CHECK(holds(site.text("FIC1500.yaml"), "  range: [0, 40.5]\n"));
}

TEST_CASE("rules complete what names omit, and bad rules are refused with their place",
          "[discover][program]") {
  const Site site;
  write_file(site.folder / "tags.csv", "tag\nX1.M\nX1.S\nX1.B\n");
  write_file(site.folder / "rules.yaml",
             "rules:\n"
             "  - {match: 'X*.M', signal: pv, loop: 'FIC-$1', unit: t/h, range: [0, 9]}\n"
             "  - {match: 'X*.S', signal: co, loop: 'FIC-$1', unit: '%', range: [0, 100]}\n"
             "  - {match: 'X*.B', signal: mode, loop: 'FIC-$1', automatic: [2], manual: [1]}\n");
  const std::string tags =
      "--tags " + site.path("tags.csv") + " --rules " + site.path("rules.yaml");
  const ShellOutcome made = site.discover(tags);
  INFO(made.text);
  REQUIRE(made.exit_code == 0);
  CHECK(holds(made.text, "; guessed: sample_time\n"));
  CHECK(holds(site.text("FIC-1.yaml"), "automatic: [2]\n"));
  write_file(site.folder / "rules.yaml", "rules:\n  - {mach: 'X*'}\n");
  const ShellOutcome refused = site.discover(tags);
  CHECK(refused.exit_code == 78);
  CHECK(holds(refused.text, "rules.yaml:2:6: error: "));
}

TEST_CASE("lists without a loop, and unreadable lists, give no files", "[discover][program]") {
  const Site site;
  write_file(site.folder / "tags.csv", "tag,low,high\nTI1,0,1\nFIC2.SP,,\n");
  const std::string out = " --out " + site.path("new") + " --tags ";
  const ShellOutcome none = site.loopwarden("discover" + out + site.path("tags.csv"));
  CHECK(none.exit_code == 65);
  CHECK(holds(none.text, "FIC2: no PV and no CO"));
  CHECK_FALSE(fs::exists(site.folder / "new"));
  write_file(site.folder / "bad.csv", "tag,low,high\nFIC1.PV,0,1\nFIC1.OP,0,x\n");
  CHECK(site.loopwarden("discover" + out + site.path("bad.csv")).exit_code == 65);
  CHECK(site.loopwarden("discover" + out + site.path("no.csv")).exit_code == 74);
  CHECK_FALSE(fs::exists(site.folder / "new"));
  CHECK(site.loopwarden("discover --out x").exit_code == 64);
  CHECK(site.discover("--tags a.csv --opcua opc.tcp://h").exit_code == 64);
  CHECK(site.loopwarden("discover --tags a.csv").exit_code == 64);
}

TEST_CASE("loops that can't get a unique tag are reported", "[discover][program]") {
  const Site site;
  const std::string long_tag(40, 'F');
  write_file(site.folder / "tags.csv", "tag\nA/F1.PV\nA/F1.OP\nA.F1.PV\nA.F1.OP\n" + long_tag +
                                           ".PV\n" + long_tag + ".OP\nF2.PV\nF2.OP\n");
  const ShellOutcome made = site.discover("--tags " + site.path("tags.csv"));
  INFO(made.text);
  CHECK(made.exit_code == 0);
  CHECK(holds(made.text,
              "A-F1: another loop has this tag. Separate them with a rule with `loop` "
              "(--rules)"));
  CHECK(holds(made.text, "has no tag of 1 to 32 letters. Set one"));
  CHECK(site.files() == 2);
  CHECK(fs::exists(site.folder / "loops.d/F2.yaml.incomplete"));
}

TEST_CASE("tags of an OPC UA server are listed by loopwarden-opcua", "[discover][program]") {
  const Site site;
  const ShellOutcome made = site.discover_by(
      "test \"$*\" = 'browse --url opc.tcp://h:4840' || exit 64\n"
      "echo 'a word on the way' >&2\n"
      "cat " +
      std::string(kExample) + "\n");
  INFO(made.text);
  CHECK(made.exit_code == 0);
  CHECK(holds(made.text, "a word on the way"));
  CHECK(holds(site.text("FIC205.yaml"), "# Found by loopwarden discover in opc.tcp://h:4840.\n"));
  CHECK(site.files() == 4);
  const ShellOutcome untrusted =
      site.discover_by("echo 'certificate 12:34:AB is not trusted' >&2; exit 78\n");
  CHECK(untrusted.exit_code == 78);
  CHECK(holds(untrusted.text, "certificate 12:34:AB is not trusted"));
  CHECK(holds(untrusted.text,
              "has listed no tags of opc.tcp://h:4840 (exit code 78). Correct the "
              "cause above, or give a list of the tags with --tags"));
  // The temporary list was removed.
  for (const auto& entry : fs::directory_iterator(site.folder.path()))
    CHECK_FALSE(holds(entry.path().filename(), "loopwarden-X"));
  CHECK(std::distance(fs::directory_iterator(site.folder.path()), fs::directory_iterator{}) == 3);
  const ShellOutcome missing =
      run("PATH=/nonexistent " LOOPWARDEN_CLI " discover --opcua opc.tcp://h --out " +
          site.path("new") + " 2>&1");
  CHECK(missing.exit_code == 74);
  CHECK(holds(missing.text, "loopwarden-opcua: No such file or directory. Install the package"));
  CHECK_FALSE(fs::exists(site.folder / "new"));
}

TEST_CASE("metrics of a Sparkplug group are listed by loopwarden-feed", "[discover][program]") {
  const Site site;
  write_file(site.folder / "births.csv",
             "name,node_id,data_type,unit,low,high,description\n"
             "line1/R2/FIC206/PV,plant/line1/R2/FIC206/PV,Float,m3/h,0,40,Feed\n"
             "line1/R2/FIC206/OP,plant/line1/R2/FIC206/OP,Float,%,0,100,\n"
             "line1/FIC207/PV,plant/line1//FIC207/PV,Float,m3/h,0,40,\n"
             "line1/FIC207/OP,plant/line1//FIC207/OP,Float,%,0,100,\n");
  write_file(
      site.folder / "loopwarden-feed",
      "#!/bin/sh\ntest \"$*\" = '--config f.yaml --browse plant --seconds 5' || exit 64\ncat " +
          site.path("births.csv") + "\n");
  ::chmod(site.path("loopwarden-feed").c_str(), 0755);
  const ShellOutcome made =
      run("PATH=" + site.folder.path().string() +
          ":$PATH " LOOPWARDEN_CLI
          " discover --sparkplug plant --feed-config f.yaml --seconds 5 --nodes " +
          site.path("metrics.yaml") + " --out " + site.path("loops.d") + " 2>&1");
  INFO(made.text);
  CHECK(made.exit_code == 0);
  CHECK(holds(site.text("FIC206.yaml"),
              "# Found by loopwarden discover in Sparkplug group plant.\n"));
  CHECK(holds(site.text("FIC206.yaml"), "pv: {feed: \"mqtt:line1/R2/FIC206/PV\"}\n"));
  const std::string rules = read_file(site.folder / "metrics.yaml");
  CHECK(holds(rules, "metrics:\n"));
  CHECK(holds(rules,
              "- {name: \"line1/R2/FIC206/PV\", group: \"plant\", edge: \"line1\", device: "
              "\"R2\", metric: \"FIC206/PV\"}\n"));
  CHECK(holds(rules, "edge: \"line1\", device: \"\", metric: \"FIC207/OP\"}\n"));
}

}  // namespace loopwarden::tests::discover_test
