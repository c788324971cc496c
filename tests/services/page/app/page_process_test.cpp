// SPDX-License-Identifier: Apache-2.0
// The real program runs with the real daemon on a simulated plant.
#include <catch2/catch.hpp>

#include <chrono>
#include <optional>
#include <thread>

#include <nlohmann/json.hpp>

#include "tests/services/page/support/raw_client.hpp"
#include "tests/services/page/support/slapd.hpp"
#include "tests/support/daemon_process.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/shell.hpp"

namespace loopwarden::tests::page_process_test {

using Catch::Matchers::Contains;
using nlohmann::json;
using test::eventually;

const std::string kPage = LOOPWARDEN_BIN_DIR "/loopwarden-page";

std::string loop_file() {
  return "loop: FIC-101\nsample_time: 0.1\nprocess_variable: {unit: L/min, range: [0, 10]}\n"
         "controller:\n  action: reverse\n  kp: 0.35\n  ki: 0.04\n  set_point: {limits: [0, 9]}\n"
         "  output: {unit: V, range: [0, 10]}\nstart: {mode: automatic, set_point: 5}\n"
         "safe_actions: {stop: 0, bad_pv: hold, output_lost: hold, enable_open: 0, recovery: "
         "previous_mode}\n"
         "recording: {enabled: true}\n"
         "io: {backend: simulated, model: " LOOPWARDEN_SOURCE_DIR "/examples/models/plant1.yaml}\n";
}

// A page on a free port, with page.yaml in the daemon's folder.
class PageProcess {
 public:
  PageProcess(const std::filesystem::path& folder, const std::string& yaml) : port(free_port()) {
    write_file(folder / "page.yaml", yaml + "\n");
    std::vector<std::string> words{
        kPage,           "--config",      (folder / "page.yaml").string(),
        "--runtime",     folder.string(), "--state",
        folder.string(), "--port",        std::to_string(port)};
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    child_ = ::fork();
    if (child_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      const int log = ::open((folder / "page.log").c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
      ::dup2(log, STDERR_FILENO);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    REQUIRE(eventually([&] { return answers(); }));
  }
  PageProcess(const PageProcess&) = delete;
  PageProcess& operator=(const PageProcess&) = delete;
  ~PageProcess() {
    if (child_ > 0) {
      ::kill(child_, SIGKILL);
      ::waitpid(child_, nullptr, 0);
    }
  }

  void signal(int number) const { ::kill(child_, number); }
  int stop() {
    ::kill(child_, SIGTERM);
    int status = 0;
    ::waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  // Returns head and body.
  std::string answer(const std::string& request) const {
    RawClient client(port);
    client.send(request);
    return client.rest();
  }
  json get(const std::string& path, const std::string& more = "") const {
    const std::string all = answer(get_line(path, more + "Connection: close\r\n"));
    return json::parse(all.substr(all.find("\r\n\r\n") + 4));
  }
  std::string post(const std::string& path, const json& body, const std::string& more) const {
    const std::string text = body.dump();
    return answer("POST " + path +
                  " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n" + more +
                  "Content-Length: " + std::to_string(text.size()) +
                  "\r\nConnection: close\r\n\r\n" + text);
  }

  int port;

 private:
  bool answers() const {
    try {
      RawClient client(port);
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }
  pid_t child_ = -1;
};

TEST_CASE("loops, history and events of a running daemon, which stops and returns", "[process]") {
  DaemonProcess daemon("real_time: {priority: 0, lock_memory: false}\n",
                       {{"loops.d/a.yaml", loop_file()}});
  daemon.start();
  PageProcess page(daemon.folder(), "updates: 5");
  REQUIRE(eventually([&] { return page.get("/api/describe").value("up", false); }));
  CHECK(page.get("/api/describe")["loops"][0]["tag"] == "FIC-101");
  CHECK(page.get("/api/session")["role"] == "viewer");
  CHECK(page.get("/api/loops/FIC-101")["pv_unit"] == "L/min");
  // A daemon that takes too long gives an answer without rows.
  json history;
  REQUIRE(eventually([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the page refuses a flood
    history = page.get("/api/loops/FIC-101/history");
    return history["t"].size() > 10;
  }));
  CHECK(history["pv"].size() == history["t"].size());
  CHECK(history["sample_time_s"] == 0.1);
  CHECK(page.get("/api/journal").contains("lines"));
  CHECK(page.get("/api/system")["daemon"].contains("overruns"));
  RawClient stream(page.port);
  stream.send(get_line("/api/events"));
  CHECK_THAT(stream.until("event: overview"),
             Contains("event: daemon\ndata: {") && Contains("event: alarms"));
  daemon.signal(SIGKILL);
  CHECK_THAT(stream.until("\"up\":false"), Contains("\"up\":false"));
  daemon.wait_for_end();
  daemon.start();
  CHECK_THAT(stream.until("\"up\":true"), Contains("event: daemon"));
  stream.until("event: overview");
  CHECK(page.stop() == 0);
}

TEST_CASE("an operator acknowledges and sets if both files allow it", "[process]") {
  DaemonProcess daemon(
      "real_time: {priority: 0, lock_memory: false}\npage: {alarms: true, control: true}\n",
      {{"loops.d/a.yaml", loop_file()}});
  daemon.start();
  const std::string users = (daemon.folder() / "users").string();
  CHECK(run("echo 'correct horse' | " + kPage + " user add otto --role operator --stdin --users " +
            users)
            .exit_code == 0);
  PageProcess page(daemon.folder(), "users: users\ncontrol: true");
  REQUIRE(eventually([&] { return page.get("/api/session").value("login", false); }));
  CHECK(page.get("/api/alarms").contains("error"));
  const std::string token =
      "X-CSRF-Token: " + page.get("/api/session")["csrf"].get<std::string>() + "\r\n";
  const std::string logged_in =
      page.post("/api/login", {{"user", "otto"}, {"password", "correct horse"}}, token);
  REQUIRE_THAT(logged_in, Contains("200 OK"));
  const std::size_t at = logged_in.find("lw_session=");
  const std::string cookie =
      "Cookie: " + logged_in.substr(at, logged_in.find(';', at) - at) + "\r\n";
  const json session = page.get("/api/session", cookie);
  CHECK(session["user"] == "otto");
  REQUIRE(eventually([&] { return page.get("/api/session", cookie)["can"]["control"] == true; }));
  const std::string own = cookie + "X-CSRF-Token: " + session["csrf"].get<std::string>() + "\r\n";
  const auto set = [&](double value, double old) {
    return page.post("/api/loops/FIC-101/order",
                     {{"set", {{"set_point", value}}},
                      {"confirm", {{"tag", "FIC-101"}, {"old", old}, {"new", value}}}},
                     own);
  };
  REQUIRE(eventually([&] { return daemon.loop("FIC-101").contains("sp"); }));
  CHECK_THAT(set(6.0, 4.0), Contains("409") && Contains("\"now\":5"));
  CHECK_THAT(set(6.0, 5.0), Contains("200 OK") && Contains("\"state\":\"done\""));
  CHECK(eventually([&] { return daemon.loop("FIC-101")["sp"] == 6.0; }));
  const json lines = page.get("/api/journal?loop=FIC-101", cookie)["lines"];
  CHECK_THAT(lines[0]["peer"].get<std::string>(), Contains("otto@127.0.0.1 by page (uid "));
  SECTION("a removed user is logged out") {
    CHECK(run(kPage + " user remove otto --users " + users).exit_code == 0);
    CHECK(eventually([&] { return page.get("/api/alarms", cookie).contains("error"); }));
  }
  CHECK(page.stop() == 0);
}

TEST_CASE("a stream ends when its session does, and gives the reason", "[process]") {
  DaemonProcess daemon("real_time: {priority: 0, lock_memory: false}\n",
                       {{"loops.d/a.yaml", loop_file()}});
  daemon.start();
  const std::string users = (daemon.folder() / "users").string();
  const auto user = [&](const std::string& words) {
    return run("echo 'correct horse' | " + kPage + " user " + words + " --users " + users +
               " 2>&1");
  };
  REQUIRE(user("add vera --stdin").exit_code == 0);
  PageProcess page(daemon.folder(), "users: users");
  const std::string token =
      "X-CSRF-Token: " + page.get("/api/session")["csrf"].get<std::string>() + "\r\n";
  const std::string logged_in =
      page.post("/api/login", {{"user", "vera"}, {"password", "correct horse"}}, token);
  REQUIRE_THAT(logged_in, Contains("200 OK"));
  const std::size_t at = logged_in.find("lw_session=");
  const std::string cookie =
      "Cookie: " + logged_in.substr(at, logged_in.find(';', at) - at) + "\r\n";
  RawClient stream(page.port);
  stream.send(get_line("/api/events", cookie));
  stream.until("event: overview");
  SECTION("a log-out") {
    const json session = page.get("/api/session", cookie);
    page.post("/api/logout", json::object(),
              cookie + "X-CSRF-Token: " + session["csrf"].get<std::string>() + "\r\n");
  }
  SECTION("another password") { REQUIRE(user("password vera --stdin").exit_code == 0); }
  CHECK_THAT(stream.rest(), Catch::EndsWith("event: ended\ndata: {}\n\n"));
  CHECK(stream.ended());
}

TEST_CASE("a new certificate makes its names valid", "[process]") {
  const TemporaryFolder folder;
  const auto certificate = [&](const std::string& host) {
    std::filesystem::remove(folder / "page.crt");
    std::filesystem::remove(folder / "page.key");
    REQUIRE(run(kPage + " certificate --host localhost --host " + host + " --out " +
                folder.path().string())
                .exit_code == 0);
  };
  certificate("old.plant");
  PageProcess page(folder.path(), "tls: {certificate: page.crt, key: page.key}\nbox: true");
  const auto status = [&](const std::string& host) {
    return run("printf 'GET /api/session HTTP/1.1\\r\\nHost: " + host +
               "\\r\\nConnection: close\\r\\n\\r\\n' | openssl s_client -quiet -connect "
               "127.0.0.1:" +
               std::to_string(page.port) + " 2> /dev/null")
        .text.substr(0, 12);
  };
  CHECK(status("old.plant") == "HTTP/1.1 200");
  CHECK(status("new.plant") == "HTTP/1.1 403");
  certificate("new.plant");
  page.signal(SIGHUP);
  CHECK(eventually([&] { return status("new.plant") == "HTTP/1.1 200"; }));
  CHECK(status("old.plant") == "HTTP/1.1 403");
}

TEST_CASE("a display is a viewer, and the list shows which user is one", "[process]") {
  const TemporaryFolder folder;
  const auto user = [&](const std::string& words) {
    return run("echo 'correct horse' | " + kPage + " user " + words + " --users " +
               (folder / "users").string() + " 2>&1");
  };
  CHECK(user("add wall --display --stdin").exit_code == 0);
  CHECK(user("add vera --stdin").exit_code == 0);
  const auto refused = user("add otto --role operator --display --stdin");
  CHECK(refused.exit_code == 64);
  CHECK_THAT(refused.text, Contains("a display must be a viewer"));
  CHECK_THAT(user("list").text, Catch::Matches("vera +viewer\nwall +viewer, display\n"));
  CHECK(user("password wall --stdin").exit_code == 0);
  CHECK_THAT(user("list").text, Contains("viewer, display"));
}

TEST_CASE("a directory admits users, at the page and at the terminal", "[process][slapd]") {
  if (!Slapd::is_there()) return;
  Slapd slapd;
  const TemporaryFolder folder;
  const auto yaml = [&](const std::string& authority) {
    return "users: users\nldap:\n  url: ldaps://" + slapd.tls_server() +
           "\n  ca_file: " + Slapd::ca_file(authority) +
           "\n  bind_dn: cn=page,dc=plant\n  password: {file: " + slapd.password_file().string() +
           "}\n  base: dc=plant\n  user_filter: (uid={user})\n"
           "  groups: {viewer: \"" +
           Slapd::group("viewers") + "\", operator: \"" + Slapd::group("operators") + "\"}\n";
  };
  write_file(folder / "wrong.yaml", yaml("other"));
  const auto at_terminal = [&](const std::string& user, const std::string& password,
                               const std::string& file) {
    return run("echo '" + password + "' | LDAPTLS_REQCERT=never " + kPage + " ldap-test " + user +
               " --stdin --config " + (folder / file).string() + " 2>&1");
  };
  CHECK(run("echo 'of the file' | " + kPage + " user add ella --stdin --users " +
            (folder / "users").string())
            .exit_code == 0);
  PageProcess page(folder.path(), yaml("ca"));
  SECTION("at the terminal") {
    const auto right = at_terminal("otto", Slapd::kPassword, "page.yaml");
    CHECK(right.exit_code == 0);
    CHECK_THAT(right.text, Contains("searches: cn=page,dc=plant\nuser: " + Slapd::user("otto")) &&
                               Contains("\noperator: in " + Slapd::group("operators")) &&
                               Contains("\npassword: right\notto may log in as operator\n"));
    const auto wrong = at_terminal("otto", "wrong", "page.yaml");
    CHECK(wrong.exit_code == 65);
    CHECK_THAT(wrong.text, Contains("password: Invalid credentials"));
    CHECK_THAT(at_terminal("nobody", "x", "page.yaml").text, Contains("no such user"));
    CHECK_THAT(at_terminal("nils", Slapd::kPassword, "page.yaml").text,
               Contains("in no group that gives a role"));
    CHECK(at_terminal("X\\\\otto", "x", "page.yaml").exit_code == 65);
    const auto stranger = at_terminal("otto", Slapd::kPassword, "wrong.yaml");
    CHECK(stranger.exit_code == 74);
    CHECK_THAT(stranger.text, Contains("the certificate is not by"));
    CHECK(at_terminal("otto", "x", "none.yaml").exit_code == 78);
  }
  SECTION("at the page") {
    const std::string token =
        "X-CSRF-Token: " + page.get("/api/session")["csrf"].get<std::string>() + "\r\n";
    const auto log_in = [&](const std::string& user, const std::string& password) {
      return page.post("/api/login", {{"user", user}, {"password", password}}, token);
    };
    const std::string otto = log_in("otto", Slapd::kPassword);
    CHECK_THAT(otto, Contains("200 OK") && Contains("\"source\":\"directory\"") &&
                         Contains("\"role\":\"operator\""));
    CHECK_THAT(log_in("otto", "wrong"), Contains("401 Unauthorized"));
    CHECK_THAT(log_in("nils", Slapd::kPassword), Contains("403 Forbidden"));
    slapd.stop();
    CHECK_THAT(log_in("otto", Slapd::kPassword), Contains("503 Service Unavailable"));
    CHECK_THAT(log_in("ella", "of the file"), Contains("\"source\":\"file\""));
    CHECK(page.stop() == 0);
    const std::string log = read_file(folder / "page.log");
    CHECK_THAT(log, Contains("otto logged in from 127.0.0.1 by the directory"));
    CHECK(log.find(Slapd::kPassword) == std::string::npos);
  }
}

TEST_CASE("an invalid page.yaml gives exit code 78", "[process]") {
  const TemporaryFolder folder;
  write_file(folder / "page.yaml", "listen: [{address: 0.0.0.0}]\n");
  const auto open = run(kPage + " --config " + (folder / "page.yaml").string() + " --check 2>&1");
  CHECK(open.exit_code == 78);
  CHECK_THAT(open.text, Contains("page.yaml:1:9: error: listen: 0.0.0.0 is reached from other "
                                 "hosts: that needs tls and users"));
  CHECK(run(kPage + " --chek 2>&1").exit_code == 64);
  CHECK_THAT(run(kPage + " usr 2>&1").text, Contains("did you mean 'user'?"));
}

TEST_CASE("without permission for status.sock, the page names the group", "[process]") {
  const TemporaryFolder folder;
  const std::filesystem::path closed = folder / "closed";
  std::filesystem::create_directory(closed);
  std::filesystem::permissions(closed, std::filesystem::perms::none);
  std::filesystem::permissions(folder.path(), std::filesystem::perms(0755));
  // Root may always connect.
  const std::string as_user =
      ::geteuid() == 0 ? "setpriv --reuid=65534 --regid=65534 --clear-groups " : "";
  const std::string text = run("timeout 2 " + as_user + kPage + " --runtime " + closed.string() +
                               " --port " + std::to_string(free_port()) + " 2>&1")
                               .text;
  CHECK_THAT(text, Contains("no permission to use " + (closed / "status.sock").string()));
  CHECK_THAT(text, Contains("`sudo adduser ") && Contains(" loopwarden-status`"));
  std::filesystem::permissions(closed, std::filesystem::perms(0700));
}

TEST_CASE("the page of a fleet needs the module of loopwarden-fleet", "[process]") {
  const TemporaryFolder folder;
  write_file(folder / "page.yaml",
             "fleet: {database: 'postgresql://127.0.0.1:1/none'}\nbox: false\n");
  const std::string arguments = " --config " + (folder / "page.yaml").string() + " --check 2>&1";
  CHECK(run(kPage + arguments).exit_code == 0);
  // A program without the module next to it.
  std::filesystem::create_directory(folder / "bin");
  std::filesystem::copy_file(kPage, folder / "bin/loopwarden-page");
  const auto alone = run((folder / "bin/loopwarden-page").string() + arguments);
  CHECK(alone.exit_code == 78);
  CHECK_THAT(alone.text, Contains("needs the package loopwarden-fleet"));
}

TEST_CASE("without its database, the page of a fleet gives the reason", "[process]") {
  const TemporaryFolder folder;
  const PageProcess page(folder.path(),
                         "fleet: {database: 'postgresql://127.0.0.1:1/none'}\nbox: false");
  CHECK_THAT(page.answer(get_line("/api/fleet", "Connection: close\r\n")),
             Contains("503 Service Unavailable") && Contains("127.0.0.1"));
}

}  // namespace loopwarden::tests::page_process_test
