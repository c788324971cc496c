// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "services/notify/config/notify_config.hpp"
#include "tests/services/notify/notify_support.hpp"

namespace config_test {

using namespace loopwarden::notify;
using namespace loopwarden::notify::test;

namespace {

const std::string kWhole = R"(channels:
  log: {kind: journal}
  mail:
    kind: email
    from: a@b
    to: [c@d]
    smtp: {host: 127.0.0.1, security: none}
  hook: {kind: webhook, url: "https://h/x"}
routes:
  - {channels: [log, mail]}
  - {channels: [hook], alarms: [daemon]}
)";

// kWhole with one part replaced.
std::string with(const std::string& part, const std::string& by) {
  std::string text = kWhole;
  const std::size_t at = text.find(part);
  REQUIRE(at != std::string::npos);
  return text.replace(at, part.size(), by);
}

std::string said(const std::string& text) {
  return loopwarden::config::to_text(read_notify_text("notify.yaml", text).diagnostics);
}

}  // namespace

TEST_CASE("the example is accepted", "[notify][config]") {
  const auto config = read_notify_file(LOOPWARDEN_SOURCE_DIR "/examples/notify/notify.yaml");
  REQUIRE(config);
  CHECK(config.diagnostics.empty());
  CHECK(config->channels.size() == 3);
  REQUIRE(config->rules.routes.size() == 3);
  // The first reminder is after an hour, with five in all. The escalation step follows.
  const std::vector<Escalation>& reminders = config->rules.routes[1].reminders;
  REQUIRE(reminders.size() == 2);
  CHECK(reminders[0].after_min == 60);
  CHECK(reminders[0].most == 4);
  CHECK(reminders[1].after_min == 30);
  CHECK(reminders[1].channels == std::vector<std::string>{"on-call"});
  CHECK(config->rules.quiet_hours.front().from_min == 22 * 60);
}

TEST_CASE("mails have pictures, webhooks if asked for, logs never", "[notify][config]") {
  const auto usual = read_notify_text("notify.yaml", kWhole);
  REQUIRE(usual->channels.size() == 3);
  CHECK(usual->channels[0].picture == false);
  CHECK(usual->channels[1].picture == true);
  CHECK(usual->channels[2].picture == false);
  const auto other =
      read_notify_text("notify.yaml", with("kind: webhook", "kind: webhook, picture: true"));
  CHECK(other->channels[2].picture == true);
  CHECK_THAT(said(with("kind: journal", "kind: journal, picture: true")),
             Catch::Contains("unknown key 'picture'"));
}

TEST_CASE("a route can name process alarms as any other", "[notify][config]") {
  const auto config = read_notify_text(
      "notify.yaml",
      with("alarms: [daemon]", "alarms: [bad_pv, output_lost, output_unknown, not_normal_mode]"));
  REQUIRE(config);
  CHECK(config->rules.routes[1].alarms ==
        std::vector<std::string>{"bad_pv", "output_lost", "output_unknown", "not_normal_mode"});
}

TEST_CASE("a file whose routes omit the box gives a warning", "[notify][config]") {
  const std::string everybody = "- {channels: [log, mail]}";
  const std::string all =
      "disk_full, clock_stepped, feeder_lost, service_failed, "
      "certificate_expires, records_dropped, disk_writes, connection_lost";
  CHECK(said(with(everybody, "- {channels: [log, mail], loops: [\"FIC-*\"]}")) ==
        "notify.yaml:10:3: warning: routes: no route to people has the box's " + all +
            ": all routes report them. Name box in the `loops` of one\n");
  CHECK(said(with(everybody, "- {channels: [log, mail], loops: [\"FIC-*\", box]}")).empty());
  // A log is no route to people.
  CHECK_THAT(
      said(with(everybody, "- {channels: [log]}\n  - {channels: [mail], loops: [\"FIC-*\"]}")),
      Catch::Contains("all routes report them"));
  CHECK_THAT(said(with(everybody, "- {channels: [log, mail], alarms: [stiction, disk_full]}")),
             Catch::Contains("no route has the box's clock_stepped, feeder_lost,") &&
                 Catch::Contains("no channel reports them"));
}

TEST_CASE("defaults of each kind of channel", "[notify][config]") {
  const auto config = read_notify_text("notify.yaml", kWhole);
  REQUIRE(config);
  CHECK(config->rules.channels[0].one_each);
  CHECK(config->rules.channels[0].group_ms == 0);
  CHECK(config->rules.channels[1].group_ms == 30'000);
  CHECK(config->rules.channels[1].most_per_hour == 20);
  CHECK(std::get<EmailSettings>(config->channels[1].kind).port == 25);
  CHECK(config->rules.routes[0].changes == std::array<bool, 4>{true, true, false, false});
  CHECK(config->socket == "/run/loopwardend/status.sock");
}

TEST_CASE("each error is reported with its place", "[notify][config]") {
  struct Case {
    const char* part;
    const char* by;
    const char* said;
  };
  const std::vector<Case> cases{
      {"kind: journal", "kind: jurnal",
       "notify.yaml:2:15: error: channels.log.kind: must be journal, syslog, email or webhook (got "
       "'jurnal'); did you mean 'journal'?"},
      {"kind: journal", "knd: journal", "unknown key 'knd'; did you mean 'kind'?"},
      {"log: {", "'l o g': {", "a channel's name has 1 to 40 letters"},
      {"from: a@b", "from: \"a@b\\nBcc: x@y\"", "error: channels.mail.from: "},
      {"from: a@b", "from: Box <a@b>", "must be an address, local@domain"},
      {"to: [c@d]", "to: []", "must hold 1 to 50 addresses"},
      {"to: [c@d]", "to: [c@d, \"e f@g\"]", "must be an address"},
      {"security: none", "security: tls, user: x", "user and password belong together"},
      {"host: 127.0.0.1, security: none", "host: mail.x, security: none",
       "may be none only if the server is this host"},
      {"host: 127.0.0.1", "host: \"a/b\"", "must be a name or an address"},
      {"smtp: {host: 127.0.0.1, security: none}", "sendmail: bin/sendmail", "absolute path"},
      {"    smtp: {host: 127.0.0.1, security: none}\n", "", "either `smtp` or `sendmail`"},
      {"https://h/x", "ftp://h/x", "must be an https:// URL"},
      {"https://h/x", "http://h/x", "warning: channels.hook.url: is not encrypted"},
      {"url: \"https://h/x\"", "url: \"https://h/x\", url_secret: {file: k}",
       "either `url` or `url_secret`"},
      {"url: \"https://h/x\"", "url: \"https://h/x\", key: {}", "either `credential` or `file`"},
      {"url: \"https://h/x\"", "url: \"https://h/x\", key: {credential: a/b}", "without '/'"},
      {"[log, mail]", "[log, mial]", "did you mean 'mail'?"},
      {"{channels: [log, mail]}", "{channels: [log]}",
       "warning: channels: no route goes to 'mail'"},
      {"{channels: [log, mail]}", "{alarms: [stiction]}", "must name a channel"},
      {"alarms: [daemon]", "alarms: [stickton]", "must hold"},
      {"alarms: [daemon]", "states: [gone]", "must hold came, went, acknowledged or shelved"},
      {"alarms: [daemon]", "min_severity_percent: 101", "must be >= 0 and <= 100 %"},
      {"alarms: [daemon]", "states: [went], repeat: {every_min: 5}",
       "must have `came` if the route repeats"},
      {"alarms: [daemon]", "repeat: {every_min: 0}", "from 1 to 10080 min"},
      {"alarms: [daemon]", "escalation: [{channels: [log]}]", "missing key 'after_min'"},
      {"channels:\n", "time_zone: Europe/Atlantis\nchannels:\n", "must be a time zone"},
      {"channels:\n", "quiet_hours: [{channels: [mail], from: '22:00', to: '06:00'}]\nchannels:\n",
       "missing key 'time_zone'"},
      {"channels:\n",
       "quiet_hours: [{channels: [mail], time_zone: UTC, from: '22:60', to: '6:00'}]\nchannels:\n",
       "must be a time of day, hh:mm (got '22:60')"},
      {"routes:", "daemon_down_after: 1\nroutes:", "must be >= 5 and <= 3600 s"},
  };
  for (const Case& one : cases) {
    INFO(one.part << " -> " << one.by);
    CHECK_THAT(said(with(one.part, one.by)), Catch::Contains(one.said));
  }
  CHECK_THAT(said("routes: []\n"), Catch::Contains("must be 1 to 32 channels"));
}

TEST_CASE("page_url is a URL of http or https, without a slash at its end", "[notify][config]") {
  const auto good = read_notify_text("n.yaml", kWhole + "page_url: 'https://box7:8443/'\n");
  REQUIRE(good);
  CHECK(good->page_url == "https://box7:8443");
  CHECK(read_notify_text("n.yaml", kWhole)->page_url.empty());
  for (const std::string bad : {"box7", "ftp://box7", "https://box 7"}) {
    CHECK_THAT(said(kWhole + "page_url: '" + bad + "'\n"),
               Catch::Contains("must be https://HOST[:PORT]"));
  }
}

TEST_CASE("docs/reference/notify-keys.md matches the description by the reader",
          "[notify][config][reference]") {
  const std::string path = LOOPWARDEN_SOURCE_DIR "/docs/reference/notify-keys.md";
  const std::string described =
      "# Keys of notify.yaml\n\n"
      "<!-- Generated from services/notify/config; tests_fleet \"[reference]\" shows how to renew "
      "it. -->\n\n"
      "Guide: [send-notifications.md](../how-to/send-notifications.md). Relative paths start from "
      "the file's folder.\n" +
      loopwarden::config::to_markdown(describe_notify());
  if (std::getenv("LOOPWARDEN_REGENERATE") != nullptr) write_file(path, described);
  INFO("to bring the file up to date: LOOPWARDEN_REGENERATE=1 bin/tests_fleet '[reference]'");
  CHECK((read_file(path) == described));
}

}  // namespace config_test
