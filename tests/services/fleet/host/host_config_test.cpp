// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/host_config.hpp"

#include <catch2/catch.hpp>

#include <string>

#include "services/fleet/host/status.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::host_config_test {
namespace {

using fleet::HostConfig;

std::string errors_of(const std::string& text) {
  const auto config = fleet::read_host_text("fleet.yaml", text);
  return config::to_text(config.diagnostics);
}

TEST_CASE("a whole fleet.yaml is read") {
  const auto config = fleet::read_host_text("/etc/loopwarden-fleet/fleet.yaml", R"(
broker: mqtts://broker.plant:8884
user: fleet
password: {credential: mqtt}
tls: {ca: ca.pem, certificate: fleet.pem, key: {file: fleet.key}}
database: postgresql://loopwarden@db.plant/loopwarden
database_password: {credential: database}
groups: [North, South]
host_id: plant1
state_directory: /srv/fleet
spool: 64
reorder_timeout: 0.5
keep: {values: 7, history: 400, evidence: 30}
evidence: {ask: false}
metrics: {address: 10.0.0.1, port: 9471}
log_level: warn
)");
  INFO(config::to_text(config.diagnostics));
  REQUIRE(config);
  CHECK(config->broker->port == 8884);
  CHECK(config->broker->tls);
  CHECK(config->ca_file == "/etc/loopwarden-fleet/ca.pem");
  CHECK(config->key.file == "/etc/loopwarden-fleet/fleet.key");
  CHECK(config->password.credential == "mqtt");
  CHECK(config->groups == std::vector<std::string>{"North", "South"});
  CHECK(config->spool_bytes == 64U * 1024U * 1024U);
  CHECK(config->retention.history_days == 400);
  CHECK(config->tracker.reorder_timeout_ms == 500);
  CHECK_FALSE(config->writer.ask_evidence);
  CHECK(fleet::host_id_of(*config, "North") == "plant1-North");
  CHECK(fleet::host_id_of(*config, "") == "plant1");
}

TEST_CASE("errors name file, place, key, what was expected, and the nearest key") {
  CHECK_THAT(errors_of("brokr: mqtt://x\n"),
             Catch::Contains("fleet.yaml:1:1: error: unknown key 'brokr'") &&
                 Catch::Contains("did you mean 'broker'"));
  CHECK_THAT(errors_of("broker: http://x\n"), Catch::Contains("fleet.yaml:1:9: error: broker"));
  CHECK_THAT(errors_of("database: mysql://x\n"), Catch::Contains("must be postgresql://"));
  CHECK_THAT(errors_of("groups: [A, B/C]\n"), Catch::Contains("'B/C' can't be a group's name"));
  CHECK_THAT(errors_of("groups: [A, A]\n"), Catch::Contains("has 'A' twice"));
  CHECK_THAT(errors_of("metrics: {address: localhost}\n"), Catch::Contains("must be a numeric"));
  CHECK_THAT(errors_of("keep: {values: 0}\n"), Catch::Contains("keep.values"));
  CHECK_THAT(errors_of("password: {}\n"), Catch::Contains("either `credential` or `file`"));
}

TEST_CASE("passwords in URLs are refused") {
  CHECK_THAT(errors_of("database: postgresql://u:secret@h/d\n"),
             Catch::Contains("holds a password"));
  CHECK_THAT(errors_of("database: 'postgresql://u@h/d?password=secret'\n"),
             Catch::Contains("holds a password"));
  CHECK_THAT(errors_of("broker: mqtt://u:secret@h\n"), Catch::Contains("error: broker"));
  CHECK(errors_of("database: postgresql://[::1]:5433/d\n").empty());
}

TEST_CASE("the command line takes precedence over the file") {
  const tests::TemporaryFolder folder;
  tests::write_file(folder / "fleet.yaml", "broker: mqtt://file\ngroups: [A]\n");
  fleet::CommandLine line{
      (folder / "fleet.yaml").string(), "mqtt://line", "postgresql:///d", {"B"}};
  const auto config = fleet::read_host_config(line);
  REQUIRE(config);
  CHECK(config->broker->host == "line");
  CHECK(config->groups == std::vector<std::string>{"B"});
  line.database.clear();
  CHECK_FALSE(fleet::read_host_config(line));
}

TEST_CASE("the program checks its file, and reports unknown words") {
  const std::string program = LOOPWARDEN_BIN_DIR "/loopwarden-fleet ";
  auto outcome = tests::run(program + "--check --broker mqtt://h --database postgresql:///d 2>&1");
  CHECK(outcome.exit_code == 0);
  CHECK_THAT(outcome.text, Catch::Contains("all groups, no errors"));
  outcome = tests::run(program + "--chek 2>&1");
  CHECK(outcome.exit_code == 64);
  CHECK_THAT(outcome.text, Catch::Contains("did you mean '--check'"));
  outcome = tests::run(program + "--check --broker mqtt://h 2>&1");
  CHECK(outcome.exit_code == 78);
  CHECK_THAT(outcome.text, Catch::Contains("database"));
}

TEST_CASE("counters are in Prometheus' format") {
  fleet::GroupStatus group;
  group.group = "A\"B";
  group.delay.add(0.03);
  group.delay.add(1000.0);
  group.delay.add(-5.0);
  const std::string text = fleet::metrics_text({group});
  CHECK_THAT(text, Catch::Contains("loopwarden_fleet_owner{group=\"A\\\"B\"} 0\n"));
  CHECK_THAT(text, Catch::Contains("delay_seconds_bucket{group=\"A\\\"B\",le=\"0.05\"} 2\n"));
  CHECK_THAT(text, Catch::Contains("delay_seconds_bucket{group=\"A\\\"B\",le=\"+Inf\"} 3\n"));
  CHECK_THAT(text, Catch::Contains("delay_seconds_sum{group=\"A\\\"B\"} 1000.03\n"));
}

}  // namespace
}  // namespace loopwarden::host_config_test
