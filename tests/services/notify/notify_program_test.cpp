// SPDX-License-Identifier: Apache-2.0
// The real program runs on the status socket of a scripted daemon.
#include <fmt/format.h>

#include "services/notify/app/channel_worker.hpp"
#include "services/notify/store/outbox.hpp"
#include "tests/services/notify/notify_support.hpp"
#include "tests/support/daemon_process.hpp"
#include "tests/support/program.hpp"
#include "tests/support/slow_disk.hpp"

namespace notify_program_test {

using namespace loopwarden::notify;
using namespace loopwarden::notify::test;
using std::chrono::milliseconds;

namespace {

const std::string kProgram = LOOPWARDEN_BIN_DIR "/loopwarden-notify";

class Program {
 public:
  // `socket`: the daemon's status socket. Empty: a path in the test's folder.
  explicit Program(const std::string& yaml, std::filesystem::path socket = {})
      : socket_(socket.empty() ? folder_ / "status.sock" : std::move(socket)) {
    write_file(config(), "box: box 12\nsocket: " + socket_.string() + "\nstate_directory: " +
                             folder_.path().string() + "\ndaemon_down_after: 5\n" + yaml);
  }

  const std::filesystem::path& socket() const { return socket_; }
  std::filesystem::path config() const { return folder_ / "notify.yaml"; }
  std::filesystem::path file(const char* name) const { return folder_ / name; }

  void start() { process_.start(); }
  int end(int number) { return process_.end(number); }
  std::string log() const { return process_.log(); }
  // One line of JSON per notification, newest first.
  std::vector<nlohmann::json> list() const {
    const auto listed = loopwarden::tests::run(kProgram + " --config " + config().string() +
                                               " --list 20000 --json 2>/dev/null");
    std::vector<nlohmann::json> rows;
    std::istringstream lines(listed.text);
    for (std::string line; std::getline(lines, line);) rows.push_back(nlohmann::json::parse(line));
    return rows;
  }

 private:
  TemporaryFolder folder_;
  std::filesystem::path socket_;
  loopwarden::tests::Program process_{{kProgram, "--config", config().string()}, file("log")};
};

// A webhook for all changes, on the server that writes the log.
std::string hook(const ForeignProcess& web,
                 const std::string& more = "group: 0, most_per_hour: 0") {
  return fmt::format(
      "channels:\n  hook: {{kind: webhook, url: 'http://127.0.0.1:{}/', {}}}\n"
      "routes: [{{channels: [hook], states: [came, went, acknowledged, shelved]}}]\n",
      web.ready("port"), more);
}

std::vector<std::string> texts(const std::filesystem::path& log) {
  std::vector<std::string> all;
  for (const nlohmann::json& line : lines_of(log)) {
    all.push_back(nlohmann::json::parse(line.at("body").get<std::string>()).at("text"));
  }
  return all;
}

bool has(const std::filesystem::path& log, std::size_t count) {
  return eventually([&] { return texts(log).size() >= count; }, std::chrono::seconds(30));
}

}  // namespace

TEST_CASE("an alarm of the daemon reaches a webhook, and so does the daemon's silence",
          "[notify][program]") {
  const TemporaryFolder folder;
  const ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  Program program(hook(web));
  FakeDaemon daemon(program.socket());
  daemon.set("FIC-101", "normal");
  program.start();
  REQUIRE(eventually([&] { return daemon.asked() > 1; }));
  daemon.set("FIC-101", "unacknowledged", true);
  REQUIRE(has(folder / "log", 1));
  daemon.write_journal({{"id", 5},
                        {"kind", "operator"},
                        {"loop", "FIC-101"},
                        {"alarm", "stiction"},
                        {"what", "acknowledge"},
                        {"peer", "uid 7"},
                        {"reason", "seen\nBcc: x"}});
  daemon.set("FIC-101", "acknowledged");
  REQUIRE(has(folder / "log", 2));
  daemon.stop();
  REQUIRE(has(folder / "log", 3));
  daemon.start();
  REQUIRE(has(folder / "log", 4));
  daemon.set("FIC-101", "normal");
  REQUIRE(has(folder / "log", 5));
  CHECK(texts(folder / "log") ==
        std::vector<std::string>{
            "[box 12] FIC-101 (cooling water): Stiction alarm, 6.1 % of CO span",
            "[box 12] FIC-101 (cooling water): Stiction acknowledged, 6.1 % of CO span, by uid 7 "
            "(seen?Bcc: x)",
            "[box 12] loopwardend does not respond, so no alarms are raised",
            "[box 12] loopwardend responds again",
            "[box 12] FIC-101 (cooling water): Stiction cleared, 6.1 % of CO span"});
  CHECK(eventually([&] { return program.list().front().at("state") == "sent"; }));
  CHECK(program.list().size() == 5);
  const auto listed =
      loopwarden::tests::run(kProgram + " --config " + program.config().string() + " --list");
  CHECK_THAT(listed.text,
             Catch::Contains(
                 "sent    [box 12] FIC-101 (cooling water): Stiction cleared, 6.1 % of CO span\n"));
  CHECK_THAT(listed.text, Catch::Contains("attempt 1: answered 200\n"));
  CHECK(program.end(SIGTERM) == 0);
}

TEST_CASE("with a slow disk under the outbox every alarm is notified once, in order",
          "[notify][program]") {
  const TemporaryFolder folder;
  const ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  Program program(hook(web));
  FakeDaemon daemon(program.socket());
  daemon.set("FIC-101", "normal");
  loopwarden::tests::SlowDisk disk;
  disk.slow(loopwarden::tests::SlowDisk::File::notifications, milliseconds(200));
  program.start();
  REQUIRE(eventually([&] { return daemon.asked() > 1; }, std::chrono::seconds(30)));
  for (std::size_t i = 0; i < 3; ++i) {
    daemon.set("FIC-101", "unacknowledged", true);
    REQUIRE(has(folder / "log", 2 * i + 1));
    daemon.set("FIC-101", "normal");
    REQUIRE(has(folder / "log", 2 * i + 2));
  }
  CHECK(program.end(SIGTERM) == 0);
  CHECK(disk.calls() > 6);
  const std::vector<std::string> told = texts(folder / "log");
  REQUIRE(told.size() == 6);
  for (std::size_t i = 0; i < told.size(); ++i) {
    CHECK_THAT(told[i], Catch::Contains(i % 2 == 0 ? "Stiction alarm" : "Stiction cleared"));
  }
}

TEST_CASE("kill -9 at any time: no event twice, no event lost", "[notify][program]") {
  const TemporaryFolder folder;
  const ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  Program program(hook(web));
  FakeDaemon daemon(program.socket());
  std::size_t raised = 0;
  const auto raise = [&] { daemon.set("FIC-" + std::to_string(raised++), "unacknowledged", true); };
  for (int round = 0; round < 12; ++round) {
    program.start();
    for (int i = 0; i < 3; ++i) raise();
    const int asked = daemon.asked();
    eventually([&] { return daemon.asked() > asked; });
    // Kills at different times after an answer: while it is stored, queued, sent or recorded.
    ::usleep(static_cast<useconds_t>(round * 25'000));
    CHECK(program.end(SIGKILL) == -SIGKILL);
    raise();  // while it is away
  }
  program.start();
  const auto told = [&] {
    std::map<std::string, int> count;
    for (const nlohmann::json& line : lines_of(folder / "log")) {
      const nlohmann::json body = nlohmann::json::parse(line.at("body").get<std::string>());
      // A message under way at a kill is sent again with its own number, and is marked as such.
      if (body.at("perhaps_twice") == true) continue;
      for (const auto& event : body.at("events")) ++count[event.at("loop")];
    }
    return count;
  };
  const auto delivered = [&] {
    std::set<std::string> loops;
    for (const nlohmann::json& line : lines_of(folder / "log")) {
      const nlohmann::json body = nlohmann::json::parse(line.at("body").get<std::string>());
      for (const auto& event : body.at("events")) loops.insert(event.at("loop"));
    }
    return loops.size();
  };
  CHECK(eventually([&] { return delivered() == raised; }, std::chrono::seconds(30)));
  for (const auto& [loop, count] : told()) {
    INFO(loop);
    CHECK(count == 1);
  }
  CHECK(program.end(SIGTERM) == 0);
}

TEST_CASE("a message under way at a kill is sent again with its number", "[notify][program]") {
  const TemporaryFolder folder;
  ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  web.command("answer hang 200");
  Program program(hook(web));
  FakeDaemon daemon(program.socket());
  daemon.set("FIC-101", "unacknowledged", true);
  program.start();
  REQUIRE(has(folder / "log", 1));
  program.end(SIGKILL);
  program.start();
  REQUIRE(has(folder / "log", 2));
  const auto lines = lines_of(folder / "log");
  const auto id = [&](std::size_t i) {
    return lines.at(i).at("headers").at("x-loopwarden-delivery");
  };
  CHECK(id(0) == id(1));
  const auto body = [&](std::size_t i) {
    return nlohmann::json::parse(lines.at(i).at("body").get<std::string>());
  };
  CHECK(body(0).at("perhaps_twice") == false);
  CHECK(body(1).at("perhaps_twice") == true);
  CHECK(body(1).at("attempt") == 2);
}

TEST_CASE("a webhook that fails and then works; events raised meanwhile are one message",
          "[notify][program]") {
  const TemporaryFolder folder;
  ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  web.command("answer 500 503 200");
  Program program(hook(web));
  FakeDaemon daemon(program.socket());
  daemon.set("FIC-1", "unacknowledged", true);
  program.start();
  REQUIRE(has(folder / "log", 1));
  for (int i = 2; i < 12; ++i) daemon.set("FIC-" + std::to_string(i), "unacknowledged", true);
  REQUIRE(has(folder / "log", 4));
  const std::vector<std::string> all = texts(folder / "log");
  CHECK(all[0] == all[1]);
  CHECK(all[1] == all[2]);
  CHECK(all[3] == "[box 12] 10 alarm changes: 10 new");
  CHECK(eventually([&] { return program.list().front().at("state") == "sent"; }));
  CHECK(program.list().back().at("attempts") == 3);
  CHECK(program.end(SIGTERM) == 0);
}

TEST_CASE("a dead channel delays no other, and its queue is bounded", "[notify][program]") {
  const TemporaryFolder folder;
  ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  ForeignProcess dead = server("web_server.py", {(folder / "dead").string()});
  dead.command("answer hang");
  const std::string yaml = fmt::format(
      "channels:\n"
      "  dead: {{kind: webhook, url: 'http://127.0.0.1:{}/', group: 0}}\n"
      "  live: {{kind: webhook, url: 'http://127.0.0.1:{}/', group: 0, most_per_hour: 0}}\n"
      "routes: [{{channels: [dead, live]}}]\n",
      dead.ready("port"), web.ready("port"));
  Program program(yaml);
  FakeDaemon daemon(program.socket());
  daemon.set("FIC-0", "unacknowledged", true);
  program.start();
  REQUIRE(has(folder / "dead", 1));
  for (std::size_t i = 1; i < 4; ++i) {
    daemon.set("FIC-" + std::to_string(i), "unacknowledged", true);
    REQUIRE(has(folder / "log", i + 1));
  }
  // One message is under way on the dead channel. The other events wait for the next message.
  CHECK(lines_of(folder / "dead").size() == 1);
  std::size_t of_dead = 0;
  for (const nlohmann::json& row : program.list()) of_dead += row.at("channel") == "dead" ? 1U : 0U;
  CHECK(of_dead == 1);
  CHECK(program.end(SIGTERM) == 0);  // does not wait for the channel that hangs
}

TEST_CASE("thousands of alarms at once give few messages that count all; logs list each",
          "[notify][program]") {
  constexpr std::size_t kAlarms = 2000;
  const TemporaryFolder folder;
  const ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  const ForeignProcess collector = server("log_server.py", {(folder / "syslog").string()});
  Program program(fmt::format(
      "channels:\n"
      "  hook: {{kind: webhook, url: 'http://127.0.0.1:{}/', group: 2, most_per_hour: 5}}\n"
      "  log: {{kind: syslog, transport: tcp, host: 127.0.0.1, port: {}}}\n"
      "routes: [{{channels: [hook, log]}}]\n",
      web.ready("port"), collector.ready("port")));
  FakeDaemon daemon(program.socket());
  for (std::size_t i = 0; i < kAlarms; ++i) {
    daemon.set("FIC-" + std::to_string(i), "unacknowledged", true);
  }
  program.start();
  REQUIRE(has(folder / "log", 1));
  const nlohmann::json body =
      nlohmann::json::parse(lines_of(folder / "log").at(0).at("body").get<std::string>());
  CHECK(body.at("count") == kAlarms);
  CHECK(body.at("events").size() == kMostListed);
  // A slow machine may delay the daemon's answer so long that its silence is notified as well.
  const auto of_alarms = [&] {
    const auto lines = lines_of(folder / "syslog");
    return static_cast<std::size_t>(std::count_if(lines.begin(), lines.end(), [](const auto& line) {
      return line.dump().find("stiction") != std::string::npos;
    }));
  };
  CHECK(eventually([&] { return of_alarms() >= kAlarms; }, std::chrono::minutes(2)));
  CHECK(of_alarms() == kAlarms);
  CHECK(program.end(SIGTERM) == 0);
}

TEST_CASE("a picture is sent where configured; a message refused with a picture is sent without it",
          "[notify][program][picture]") {
  const TemporaryFolder folder;
  ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  web.command("answer 413 200");
  Program program(hook(web, "group: 0, picture: true"));
  FakeDaemon daemon(program.socket());
  nlohmann::json trend = {{"ok", true}, {"period", {1, 2}}, {"mode", {"AUTO", "AUTO"}}};
  for (const char* name : {"sp", "pv", "co", "stem", "jacket", "compensator"}) trend[name] = {5, 6};
  daemon.set_trend(trend);
  daemon.set("FIC-101", "unacknowledged", true);
  program.start();
  REQUIRE(has(folder / "log", 2));
  const auto event = [&](std::size_t i) {
    return nlohmann::json::parse(lines_of(folder / "log").at(i).at("body").get<std::string>())
        .at("events")
        .at(0);
  };
  CHECK(event(0).at("picture").get<std::string>().starts_with("iVBORw0KGgo"));
  CHECK_FALSE(event(1).contains("picture"));
  CHECK(eventually([&] { return program.list().front().at("state") == "sent"; }));
  CHECK(program.list().front().at("attempts") == 1);
  CHECK(program.end(SIGTERM) == 0);
}

TEST_CASE("--test reports the result of each channel", "[notify][program]") {
  const TemporaryFolder folder;
  ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  const Program program(
      fmt::format("channels:\n"
                  "  good: {{kind: webhook, url: 'http://127.0.0.1:{}/'}}\n"
                  "  local: {{kind: syslog, socket: {}}}\n"
                  "routes: [{{channels: [good, local]}}]\n",
                  web.ready("port"), (folder / "none").string()));
  const auto test = [&](const std::string& more) {
    return loopwarden::tests::run(kProgram + " --config " + program.config().string() + " --test" +
                                  more + " 2>&1");
  };
  const auto all = test("");
  CHECK(all.exit_code == 74);
  CHECK_THAT(all.text, Catch::Contains("good: sent: answered 200\n"));
  CHECK_THAT(all.text, Catch::Contains("local: failed: "));
  CHECK(test(" good").exit_code == 0);
  CHECK(texts(folder / "log").back() == "[box 12] test of channel good");
  const auto unknown = test(" goood");
  CHECK(unknown.exit_code == 64);
  CHECK_THAT(unknown.text, Catch::Contains("did you mean 'good'?"));
  web.command("answer 404");
  CHECK_THAT(test(" good").text, Catch::Contains("good: refused: refused with 404"));
}

TEST_CASE("a mail server that refuses the password is asked once, and this is reported at once",
          "[notify][program]") {
  const TemporaryFolder folder;
  const Certificates& files = certificates();
  const std::string password = (folder / "password").string();
  const ForeignProcess smtp =
      server("mail_server.py", {(folder / "mail").string(), "--starttls", files.file("server.pem"),
                                files.file("server.key"), "--user", "box12", "right"});
  write_file(password, "wrong\n");
  Program program(
      fmt::format("channels:\n  mail: {{kind: email, from: a@b.example, to: [c@d.example], group: "
                  "0, smtp: {{host: "
                  "127.0.0.1, port: {}, security: starttls, ca_file: {}, user: box12, password: "
                  "{{file: {}}}}}}}\n"
                  "routes: [{{channels: [mail]}}]\n",
                  smtp.ready("port"), files.file("ca.pem"), password));
  const auto test =
      loopwarden::tests::run(kProgram + " --config " + program.config().string() + " --test 2>&1");
  CHECK(test.exit_code == 74);
  CHECK_THAT(test.text, Catch::Contains("mail: refused: ") && Catch::Contains("535"));
  FakeDaemon daemon(program.socket());
  daemon.set("FIC-101", "unacknowledged", true);
  program.start();
  const auto newest = [&](const char* key) {
    const auto rows = program.list();
    return rows.empty() ? nlohmann::json() : rows.front().at(key);
  };
  REQUIRE(eventually([&] { return newest("result").dump().find("535") != std::string::npos; }));
  CHECK_THAT(program.log(), Catch::Contains("error channel mail: message 1 waits") &&
                                Catch::Contains("the channel sends again after the next start"));
  // Longer than the pause after a temporary fault. Another alarm causes no new attempt.
  daemon.set("FIC-102", "unacknowledged", true);
  std::this_thread::sleep_for(std::chrono::seconds(5));
  CHECK(newest("attempts") == 1);
  CHECK(newest("state") == "queued");
  CHECK(program.end(SIGTERM) == 0);
  write_file(password, "right\n");
  program.start();
  CHECK(
      eventually([&] { return lines_of(folder / "mail").size() == 2; }, std::chrono::seconds(30)));
  CHECK(program.end(SIGTERM) == 0);
}

// Runs at five times real time, which a slow machine can keep up with. A window without a missing
// cycle is then soon complete.
TEST_CASE(
    "an alarm raised by the daemon's own monitor is notified, and its operator's actions are too",
    "[notify][plant]") {
  std::string model = read_file(LOOPWARDEN_SOURCE_DIR "/examples/models/plant1.yaml");
  const std::string slow = "from: 120, ramp: 180";
  model.replace(model.find(slow), slow.size(), "from: 0, ramp: 1");
  loopwarden::tests::DaemonProcess daemon(
      "accelerate: 5\nreal_time: {priority: 0, lock_memory: false}\n",
      {{"models/sticking.yaml", model},
       {"loops.d/FIC-101.yaml",
        "loop: FIC-101\nsample_time: 0.1\nprocess_variable: {unit: L/min, range: [0, 10]}\n"
        "controller: {action: reverse, kp: 0.3494, ki: 0.040007, set_point: {limits: [0, 9]}, "
        "output: {unit: V, range: [0, 10]}}\n"
        "start: {mode: automatic, set_point: 5}\n"
        "safe_actions: {stop: 0, bad_pv: hold, output_lost: hold, late_cycle_periods: 100, "
        "enable_open: 0, recovery: previous_mode}\n"
        "monitor: {specialists: " LOOPWARDEN_SOURCE_DIR "/examples/specialists/plant1}\n"
        "io: {backend: simulated, model: ../models/sticking.yaml}\n"}});
  const TemporaryFolder folder;
  const ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  Program program(hook(web), daemon.folder() / "status.sock");
  daemon.start();
  program.start();
  // Returns the notification about the change, or an empty text before it arrives.
  const auto told = [&](const std::string& what) {
    for (const std::string& text : texts(folder / "log")) {
      if (text.starts_with("[box 12] FIC-101: Stiction " + what)) return text;
    }
    return std::string();
  };
  REQUIRE(eventually([&] { return !told("came, ").empty(); }, std::chrono::minutes(15)));
  CHECK(daemon.loop("FIC-101").at("alarms").at("stiction").at("state") == "unacknowledged");
  daemon.acknowledge("FIC-101", "stiction");
  REQUIRE(eventually([&] { return !told("acknowledged, ").empty(); }, std::chrono::seconds(60)));
  CHECK_THAT(told("acknowledged, "), Catch::Contains(", by "));
  CHECK(program.end(SIGTERM) == 0);
}

TEST_CASE("exit codes of the command line", "[notify][program]") {
  const auto code = [](const std::string& arguments) {
    return loopwarden::tests::run(kProgram + " " + arguments + " >/dev/null 2>&1").exit_code;
  };
  const std::string example = LOOPWARDEN_SOURCE_DIR "/examples/notify/notify.yaml";
  CHECK(code("--help") == 0);
  CHECK(code("--version") == 0);
  CHECK(code("") == 64);
  CHECK(code("--config " + example + " --check") == 0);
  CHECK(code("--config " + example + " --check --list") == 64);
  CHECK(code("--config " + example + " --chekc") == 64);
  CHECK(code("--config " + example + " --list 5") == 74);
  CHECK(code("--config /no/such/file --check") == 78);
}

TEST_CASE("a missing secret gives 78, a damaged store is moved aside", "[notify][program]") {
  Program secret(
      "channels: {hook: {kind: webhook, url: 'https://127.0.0.1/', key: {file: none}}}\n"
      "routes: [{channels: [hook]}]\n");
  secret.start();
  CHECK(eventually([&] { return secret.log().find("can't be read") != std::string::npos; }));
  CHECK(secret.end(0) == 78);

  const TemporaryFolder folder;
  const ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  Program damaged(hook(web));
  write_file(damaged.file("notifications.sqlite"), std::string(8192, 'x'));
  FakeDaemon daemon(damaged.socket());
  daemon.set("FIC-101", "unacknowledged", true);
  damaged.start();
  CHECK(has(folder / "log", 1));
  CHECK_THAT(damaged.log(), Catch::Contains("A new file is used"));
}

TEST_CASE("a queue of a later version ends the program with 78 and is kept", "[notify][program]") {
  Program program(
      "channels: {hook: {kind: webhook, url: 'https://127.0.0.1/'}}\n"
      "routes: [{channels: [hook]}]\n");
  const std::filesystem::path file = program.file("notifications.sqlite");
  { const Outbox outbox(file); }
  loopwarden::sqlite::Database(file, loopwarden::sqlite::Access::write, std::chrono::seconds(1))
      .execute("PRAGMA user_version=2");
  const std::string before = read_file(file);
  program.start();
  CHECK(program.end(0) == 78);
  CHECK_THAT(program.log(), Catch::Contains("file of notifications of version 2"));
  const auto listed =
      loopwarden::tests::run(kProgram + " --config " + program.config().string() + " --list 2>&1");
  CHECK(listed.exit_code == 78);
  CHECK_THAT(listed.text, Catch::Contains("this program knows version 1"));
  CHECK(read_file(file) == before);
}

TEST_CASE("the result of an attempt decides the state of its message", "[notify][store]") {
  const Message message = message_with({event_of("F")});
  CHECK(judge(sent("ok"), message, kNoon, 0.5).state == MessageState::sent);
  CHECK(judge(refused("no"), message, kNoon, 0.5).state == MessageState::failed);
  CHECK(judge({Delivery::Outcome::sent_to_some, "but", {}}, message, kNoon, 0.5).state ==
        MessageState::sent);
  const Attempt shut_out = judge({Delivery::Outcome::shut_out, "535", {}}, message, kNoon, 0.5);
  CHECK(shut_out.state == MessageState::queued);
  CHECK(shut_out.again_ms == 0);
  const Attempt again = judge(later("busy"), message, kNoon, 1.0);
  CHECK(again.state == MessageState::queued);
  CHECK(again.again_ms == kNoon + kBackOff.first.count());
  Delivery wait = later("busy");
  wait.wait_ms = 120'000;
  CHECK(judge(wait, message, kNoon, 1.0).again_ms == kNoon + 120'000);
  const Attempt given_up = judge(later("busy"), message, kNoon + kGiveUp_ms, 1.0);
  CHECK(given_up.state == MessageState::failed);
  CHECK_THAT(given_up.result, Catch::Contains("given up after 1 attempts"));
}

}  // namespace notify_program_test
