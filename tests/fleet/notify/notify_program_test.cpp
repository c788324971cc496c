// SPDX-License-Identifier: Apache-2.0
// The program itself, on the status socket of a daemon that answers what the test wants.
#include <fcntl.h>
#include <fmt/format.h>

#include "fleet/notify/app/channel_worker.hpp"
#include "fleet/notify/store/outbox.hpp"
#include "tests/fleet/notify/notify_support.hpp"

namespace notify_program_test {

using namespace loopwarden::notify;
using namespace loopwarden::notify::test;
using std::chrono::milliseconds;

namespace {

const std::string kProgram = LOOPWARDEN_BIN_DIR "/loopwarden-notify";

class Program {
 public:
  explicit Program(const std::string& yaml) {
    write_file(config(), "box: box 12\nsocket: " + socket().string() + "\nstate_directory: " +
                             folder_.path().string() + "\ndaemon_down_after: 5\n" + yaml);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program() { signal(SIGKILL); }

  std::filesystem::path socket() const { return folder_ / "status.sock"; }
  std::filesystem::path config() const { return folder_ / "notify.yaml"; }
  std::filesystem::path file(const char* name) const { return folder_ / name; }

  void start() {
    child_ = ::fork();
    REQUIRE(child_ >= 0);
    if (child_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      const int log = ::open(file("log").c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
      ::dup2(log, STDERR_FILENO);
      ::execl(kProgram.c_str(), kProgram.c_str(), "--config", config().c_str(), nullptr);
      ::_exit(127);
    }
  }
  // Waits for the end; the exit code, or -signal.
  int signal(int number) {
    if (child_ <= 0) return 0;
    ::kill(child_, number);
    int status = 0;
    ::waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  std::string log() const {
    return std::filesystem::exists(file("log")) ? read_file(file("log")) : std::string();
  }
  // One line of JSON a notification, newest first.
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
  pid_t child_ = -1;
};

// A webhook for everything, on the server of that log.
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

TEST_CASE("an alarm's way from the daemon to a webhook, and the daemon's silence",
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
            "box 12: FIC-101: stiction came, 6.1 %",
            "box 12: FIC-101: stiction acknowledged, 6.1 %, by uid 7 (seen?Bcc: x)",
            "box 12: the daemon does not answer: no loop is watched",
            "box 12: the daemon answers again", "box 12: FIC-101: stiction went, 6.1 %"});
  CHECK(eventually([&] { return program.list().front().at("state") == "sent"; }));
  CHECK(program.list().size() == 5);
  const auto listed =
      loopwarden::tests::run(kProgram + " --config " + program.config().string() + " --list");
  CHECK_THAT(listed.text, Catch::Contains("sent    box 12: FIC-101: stiction went, 6.1 %\n"));
  CHECK_THAT(listed.text, Catch::Contains("attempt 1: answered 200\n"));
  CHECK(program.signal(SIGTERM) == 0);
}

TEST_CASE("kill -9 at any time: nothing twice, nothing forgotten", "[notify][program]") {
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
    // Sooner and later after an answer: while it is stored, queued, sent, taken down.
    ::usleep(static_cast<useconds_t>(round * 25'000));
    CHECK(program.signal(SIGKILL) == -SIGKILL);
    raise();  // while it is away
  }
  program.start();
  const auto told = [&] {
    std::map<std::string, int> count;
    for (const nlohmann::json& line : lines_of(folder / "log")) {
      const nlohmann::json body = nlohmann::json::parse(line.at("body").get<std::string>());
      // What was under way at a kill comes again under its own number, and says so.
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
  CHECK(program.signal(SIGTERM) == 0);
}

TEST_CASE("a message under way at a kill comes again with its number", "[notify][program]") {
  const TemporaryFolder folder;
  ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  web.command("answer hang 200");
  Program program(hook(web));
  FakeDaemon daemon(program.socket());
  daemon.set("FIC-101", "unacknowledged", true);
  program.start();
  REQUIRE(has(folder / "log", 1));
  program.signal(SIGKILL);
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

TEST_CASE("a webhook that fails and then works; what came meanwhile is one message",
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
  CHECK(all[3] == "box 12: 10 changes of alarms: 10 came");
  CHECK(eventually([&] { return program.list().front().at("state") == "sent"; }));
  CHECK(program.list().back().at("attempts") == 3);
  CHECK(program.signal(SIGTERM) == 0);
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
  // One message is under way on the dead one; the rest has gathered for the next.
  CHECK(lines_of(folder / "dead").size() == 1);
  std::size_t of_dead = 0;
  for (const nlohmann::json& row : program.list()) of_dead += row.at("channel") == "dead" ? 1U : 0U;
  CHECK(of_dead == 1);
  CHECK(program.signal(SIGTERM) == 0);  // does not wait for the one that hangs
}

TEST_CASE("thousands of alarms at once: few messages, all of them counted, logs have each",
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
  CHECK(eventually([&] { return lines_of(folder / "syslog").size() == kAlarms; },
                   std::chrono::minutes(10)));
  CHECK(program.signal(SIGTERM) == 0);
}

TEST_CASE("--test says what came of each channel", "[notify][program]") {
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
  CHECK(texts(folder / "log").back() == "box 12: test of channel good");
  const auto unknown = test(" goood");
  CHECK(unknown.exit_code == 64);
  CHECK_THAT(unknown.text, Catch::Contains("did you mean 'good'?"));
  web.command("answer 404");
  CHECK_THAT(test(" good").text, Catch::Contains("good: refused: refused with 404"));
}

TEST_CASE("exit codes of the command line", "[notify][program]") {
  const auto code = [](const std::string& arguments) {
    return loopwarden::tests::run(kProgram + " " + arguments + " >/dev/null 2>&1").exit_code;
  };
  const std::string example = LOOPWARDEN_SOURCE_DIR "/config/examples/notify/notify.yaml";
  CHECK(code("--help") == 0);
  CHECK(code("--version") == 0);
  CHECK(code("") == 64);
  CHECK(code("--config " + example + " --check") == 0);
  CHECK(code("--config " + example + " --check --list") == 64);
  CHECK(code("--config " + example + " --chekc") == 64);
  CHECK(code("--config " + example + " --list 5") == 74);
  CHECK(code("--config /no/such/file --check") == 78);
}

TEST_CASE("a missing secret ends with 78, a damaged store is put aside", "[notify][program]") {
  Program secret(
      "channels: {hook: {kind: webhook, url: 'https://127.0.0.1/', key: {file: none}}}\n"
      "routes: [{channels: [hook]}]\n");
  secret.start();
  CHECK(eventually([&] { return secret.log().find("is missing") != std::string::npos; }));
  CHECK(secret.signal(0) == 78);

  const TemporaryFolder folder;
  const ForeignProcess web = server("web_server.py", {(folder / "log").string()});
  Program damaged(hook(web));
  write_file(damaged.file("notifications.sqlite"), std::string(8192, 'x'));
  FakeDaemon daemon(damaged.socket());
  daemon.set("FIC-101", "unacknowledged", true);
  damaged.start();
  CHECK(has(folder / "log", 1));
  CHECK_THAT(damaged.log(), Catch::Contains("a new one begins"));
}

TEST_CASE("what an attempt means for its message", "[notify][store]") {
  const Message message = message_with({event_of("F")});
  const BackOff back_off;
  CHECK(judge(sent("ok"), message, back_off, kNoon, 0.5).state == MessageState::sent);
  CHECK(judge(refused("no"), message, back_off, kNoon, 0.5).state == MessageState::failed);
  const Attempt again = judge(later("busy"), message, back_off, kNoon, 1.0);
  CHECK(again.state == MessageState::queued);
  CHECK(again.again_ms == kNoon + back_off.first_ms);
  Delivery wait = later("busy");
  wait.wait_ms = 120'000;
  CHECK(judge(wait, message, back_off, kNoon, 1.0).again_ms == kNoon + 120'000);
  const Attempt given_up =
      judge(later("busy"), message, back_off, kNoon + back_off.give_up_ms, 1.0);
  CHECK(given_up.state == MessageState::failed);
  CHECK_THAT(given_up.result, Catch::Contains("given up after 1 attempts"));
}

}  // namespace notify_program_test
